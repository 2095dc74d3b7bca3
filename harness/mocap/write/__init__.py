"""Motion in the formats of other programs."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.mocap.write.body_model import BodyModel as BodyModel
    from harness.mocap.write.body_model import MountedStation as MountedStation
    from harness.mocap.write.bvh import bvh_files as bvh_files
    from harness.mocap.write.bvh import channel_values as channel_values
    from harness.mocap.write.bvh import format_row as format_row
    from harness.mocap.write.bvh import hierarchy_lines as hierarchy_lines
    from harness.mocap.write.export import EXPORT_FORMATS as EXPORT_FORMATS
    from harness.mocap.write.export import export_motion as export_motion
    from harness.mocap.write.posed_motion import PosedMotion as PosedMotion
    from harness.mocap.write.posed_motion import pose_truth_and_estimate as pose_truth_and_estimate
else:
    __getattr__, __dir__ = lazy_names(__name__)
