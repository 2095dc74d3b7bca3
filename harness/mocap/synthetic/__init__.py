"""The motion generator: procedural, seeded full-body motion of 64 performers, which needs no download."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.mocap.synthetic.performers import (
        REFERENCE_PERFORMERS,
        UNLISTED_PERFORMERS,
        performer_names,
        performer_skeleton,
        sample_skeletons,
    )
    from harness.mocap.synthetic.takes import (
        BEHAVIOURS,
        RIG_TAKES,
        SOURCE,
        generate,
        generate_rig,
        stretch_marks,
        take_names,
    )
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "BEHAVIOURS",
    "REFERENCE_PERFORMERS",
    "RIG_TAKES",
    "SOURCE",
    "UNLISTED_PERFORMERS",
    "generate",
    "generate_rig",
    "performer_names",
    "performer_skeleton",
    "sample_skeletons",
    "stretch_marks",
    "take_names",
]
