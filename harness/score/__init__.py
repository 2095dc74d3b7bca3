"""Metrics, one function each, and the scores of an estimated motion."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.score.angles import hinge_errors_deg as hinge_errors_deg
    from harness.score.angles import local_errors_deg as local_errors_deg
    from harness.score.angles import wrap_difference as wrap_difference
    from harness.score.loops import COVERAGE_FLOOR as COVERAGE_FLOOR
    from harness.score.loops import WARM_UP_S as WARM_UP_S
    from harness.score.loops import LoopFrames as LoopFrames
    from harness.score.loops import LoopScores as LoopScores
    from harness.score.loops import pool_frames as pool_frames
    from harness.score.loops import score_loops as score_loops
    from harness.score.metrics import DEFINITIONS as DEFINITIONS
    from harness.score.metrics import FRAME_METRICS as FRAME_METRICS
    from harness.score.metrics import VERSIONS as VERSIONS
    from harness.score.metrics import Definition as Definition
    from harness.score.null_methods import score_null_methods as score_null_methods
    from harness.score.pair import Pair as Pair
    from harness.score.pair import PoseSequence as PoseSequence
    from harness.score.pair import compute_poses as compute_poses
    from harness.score.pair import hinged_bones as hinged_bones
    from harness.score.pair import joint_names as joint_names
    from harness.score.positions import joint_errors_mm as joint_errors_mm
    from harness.score.positions import root_position_mm as root_position_mm
    from harness.score.score import Scores as Scores
    from harness.score.score import score_estimate as score_estimate
    from harness.score.timing import step_relative as step_relative
    from harness.score.timing import step_times_ms as step_times_ms
    from harness.score.uncertainty import SIGMA_DEFINITIONS as SIGMA_DEFINITIONS
    from harness.score.uncertainty import SigmaSums as SigmaSums
    from harness.score.uncertainty import in_skeleton_order as in_skeleton_order
    from harness.score.uncertainty import score_sigma as score_sigma
    from harness.score.uncertainty import sum_sigma as sum_sigma
else:
    __getattr__, __dir__ = lazy_names(__name__)
