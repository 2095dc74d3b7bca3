"""All metrics by their name in files and tables: unit, definition, version, and the function that computes them.

A version increases whenever the same motion gives another number. Results with different versions are not comparable.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from harness.core.arrays import Floats
from harness.score import angles, contact, positions
from harness.score.pair import Pair

Pool = Literal["mean", "rms", "none"]


@dataclass(frozen=True)
class Definition:
    """Definition of a metric."""

    unit: str
    text: str
    version: int = 1
    pool: Pool = "none"
    """Pooling of per-frame values to one number; `none` where there are no per-frame values."""


FRAME_METRICS: dict[str, Callable[[Pair], Floats]] = {
    function.__name__: function
    for function in (
        angles.joint_angle_mean_deg,
        angles.joint_angle_rms_deg,
        angles.mpjre_deg,
        angles.mpjre_axis_angle_deg,
        angles.joint_geodesic_global_deg,
        angles.sip_error_deg,
        angles.root_angle_deg,
        angles.root_heading_deg,
        positions.mpjpe_mm,
        positions.mpjpe_root_mm,
        positions.mpjpe_pa_mm,
        positions.root_position_mm,
        positions.upper_position_mm,
        positions.lower_position_mm,
        positions.hands_position_mm,
        positions.feet_position_mm,
        contact.mpjve_mm_s,
        contact.jitter_m_s3,
        contact.jitter_true_m_s3,
        contact.foot_skate_mm_s,
        contact.foot_skate_true_mm_s,
        contact.penetration_mm,
        contact.penetration_true_mm,
        contact.float_mm,
        contact.float_true_mm,
    )
}

DEFINITIONS: dict[str, Definition] = {
    "frames_matched": Definition("frames", "frames with an estimate, after the warm-up"),
    "frames_expected": Definition("frames", "true frames after the warm-up"),
    "coverage": Definition("share", "frames matched / expected; below the floor nothing else is measured"),
    "frames_warm_up": Definition("frames", "estimates within the warm-up, which are not scored"),
    "frames_held": Definition("frames", "matched frames with status HELD (too few readings)"),
    "frames_lost": Definition("frames", "matched frames with status LOST (most stations missing for long)"),
    "frames_fallback": Definition("frames", "matched frames that a fallback answered in place of the method's model"),
    "frames_bridged": Definition("frames", "matched frames without readings, answered by the last or a predicted pose"),
    "frames_not_finite": Definition("frames", "estimates with NaN or infinity, counted as not matched"),
    "fallback_share": Definition(
        "share", "frames that a fallback answered / undisturbed frames: every station reported for the last 0.5 s"
    ),
    "joint_angle_mean_deg": Definition(
        "deg", "mean |difference| of the 48 hinge angles, wrapped, root excluded", 1, "mean"
    ),
    "joint_angle_rms_deg": Definition("deg", "root mean square difference of the 48 hinge angles", 1, "rms"),
    "mpjre_deg": Definition("deg", "mean geodesic error of the 22 hinged bones relative to their parents", 1, "mean"),
    "mpjre_axis_angle_deg": Definition(
        "deg", "mean |difference| of axis-angle components of the 22 hinged bones (head-set literature)", 1, "mean"
    ),
    "joint_geodesic_global_deg": Definition(
        "deg", "mean geodesic error of the 22 hinged bones' global rotations, roots aligned", 1, "mean"
    ),
    "sip_error_deg": Definition(
        "deg", "mean geodesic error of global rotations of upper arms and thighs, roots aligned", 1, "mean"
    ),
    "root_angle_deg": Definition("deg", "geodesic error of the root's orientation", 1, "mean"),
    "root_heading_deg": Definition("deg", "mean |difference| of the root's yaw, wrapped", 1, "mean"),
    "mpjpe_mm": Definition("mm", "mean distance of the 25 joint centres, without alignment", 1, "mean"),
    "mpjpe_root_mm": Definition("mm", "mean distance of the joint centres, root positions subtracted", 1, "mean"),
    "mpjpe_pa_mm": Definition(
        "mm", "mean distance of the joint centres after the best rigid alignment of each frame", 1, "mean"
    ),
    "root_position_mm": Definition("mm", "mean distance of the root", 1, "mean"),
    "root_drift_mm_s": Definition("mm/s", "growth rate of the root error (least-squares line)"),
    "upper_position_mm": Definition("mm", "mean distance of the 16 joints of spine, neck, head and arms", 1, "mean"),
    "lower_position_mm": Definition("mm", "mean distance of the 8 joints of hips and legs", 1, "mean"),
    "hands_position_mm": Definition("mm", "mean distance of the far ends of the hands", 1, "mean"),
    "feet_position_mm": Definition("mm", "mean distance of the far ends of the feet", 1, "mean"),
    "mpjve_mm_s": Definition("mm/s", "mean error of the 25 joint centres' velocities", 1, "mean"),
    "jitter_m_s3": Definition("m/s³", "mean jerk of the 25 joint centres: third difference × rate³", 1, "mean"),
    "jitter_true_m_s3": Definition("m/s³", "the truth's own jitter", 1, "mean"),
    "foot_skate_mm_s": Definition(
        "mm/s", "horizontal speed of ankles and toes that truly touch the ground (< 5 cm, < 15 cm/s)", 1, "mean"
    ),
    "foot_skate_true_mm_s": Definition("mm/s", "the truth's own foot skate", 1, "mean"),
    "penetration_mm": Definition(
        "mm", "depth of the lowest ankle or toe below the ground that the truth stands on, in contact frames", 1, "mean"
    ),
    "penetration_true_mm": Definition("mm", "the truth's own penetration", 1, "mean"),
    "float_mm": Definition(
        "mm",
        "height of the lowest ankle or toe above the ground that the truth stands on, in contact frames",
        1,
        "mean",
    ),
    "float_true_mm": Definition("mm", "the truth's own float", 1, "mean"),
    "lag_ms": Definition("ms", "shift that minimises joint_angle_mean_deg, positive when late; reported, not removed"),
    "step_mean_ms": Definition("ms", "mean wall time of one step, the first frame left out"),
    "step_p50_ms": Definition("ms", "median wall time of one step"),
    "step_p95_ms": Definition("ms", "95th percentile of the step time"),
    "step_p99_ms": Definition("ms", "99th percentile of the step time"),
    "first_step_ms": Definition("ms", "wall time of the first step"),
    "fps": Definition("frames/s", "1000 / step_mean_ms"),
    "step_relative": Definition("x", "median CPU time of a step / that of a fixed reference workload"),
}

VERSIONS: dict[str, int] = {name: definition.version for name, definition in DEFINITIONS.items()}
