"""The built-in performer: procedural, seeded full-body motion, so that nothing needs a download."""

from harness.mocap.synthetic.performers import performers, population, skeleton
from harness.mocap.synthetic.takes import BEHAVIOURS, SOURCE, generate, take_names

__all__ = ["BEHAVIOURS", "SOURCE", "generate", "performers", "population", "skeleton", "take_names"]
