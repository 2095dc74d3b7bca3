"""The motion generator: procedural, seeded full-body motion of 64 performers, which needs no download."""

from harness.mocap.synthetic.performers import (
    REFERENCE_PERFORMERS,
    performer_names,
    performer_skeleton,
    sample_skeletons,
)
from harness.mocap.synthetic.takes import BEHAVIOURS, SOURCE, generate, take_names

__all__ = [
    "BEHAVIOURS",
    "REFERENCE_PERFORMERS",
    "SOURCE",
    "generate",
    "performer_names",
    "performer_skeleton",
    "sample_skeletons",
    "take_names",
]
