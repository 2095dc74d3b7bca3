"""Motion in the formats of other programs."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.mocap.write.body_model import BodyModel, MountedStation
    from harness.mocap.write.bvh import bvh_files, channel_values, format_row, hierarchy_lines
    from harness.mocap.write.export import EXPORT_FORMATS, export_motion
    from harness.mocap.write.posed_motion import PosedMotion, pose_truth_and_estimate
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "EXPORT_FORMATS",
    "BodyModel",
    "MountedStation",
    "PosedMotion",
    "bvh_files",
    "channel_values",
    "export_motion",
    "format_row",
    "hierarchy_lines",
    "pose_truth_and_estimate",
]
