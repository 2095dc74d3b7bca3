"""Metrics, one function each, and the scores of an estimated motion."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.score.angles import hinge_errors_deg, local_errors_deg, wrap_difference
    from harness.score.loops import COVERAGE_FLOOR, WARM_UP_S, LoopFrames, LoopScores, pool_frames, score_loops
    from harness.score.metrics import DEFINITIONS, FRAME_METRICS, VERSIONS, Definition
    from harness.score.null_methods import score_null_methods
    from harness.score.pair import Pair, PoseSequence, compute_poses, hinged_bones, joint_names
    from harness.score.positions import joint_errors_mm, root_position_mm
    from harness.score.score import Scores, score_estimate
    from harness.score.timing import step_relative, step_times_ms
    from harness.score.uncertainty import SIGMA_DEFINITIONS, SigmaSums, in_skeleton_order, score_sigma, sum_sigma
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "COVERAGE_FLOOR",
    "DEFINITIONS",
    "FRAME_METRICS",
    "SIGMA_DEFINITIONS",
    "VERSIONS",
    "WARM_UP_S",
    "Definition",
    "LoopFrames",
    "LoopScores",
    "Pair",
    "PoseSequence",
    "Scores",
    "SigmaSums",
    "compute_poses",
    "hinge_errors_deg",
    "hinged_bones",
    "in_skeleton_order",
    "joint_errors_mm",
    "joint_names",
    "local_errors_deg",
    "pool_frames",
    "root_position_mm",
    "score_estimate",
    "score_loops",
    "score_null_methods",
    "score_sigma",
    "step_relative",
    "step_times_ms",
    "sum_sigma",
    "wrap_difference",
]
