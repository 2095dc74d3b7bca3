"""The largest difference of each metric that has no practical importance, and which metrics a gate watches.

Relative to the reference's mean, with a floor for means near zero. docs/studies.md says how they were found.
"""

from dataclasses import dataclass

from harness.errors import UnknownName

GATED_METRICS = ("joint_angle_mean_deg", "mpjpe_mm", "jitter_m_s3", "step_relative")
"""What a comparison's outcome rests on unless it is told otherwise."""
TIME_METRICS = ("step_relative", "step_mean_ms", "step_p50_ms", "step_p95_ms", "step_p99_ms", "fps")
"""How long steps take: figures of one processor, the relative one included, which differs by a fifth between kinds."""
INFORMATIVE_METRICS = ("mpjre_deg", "mpjpe_root_mm", "foot_skate_mm_s")
"""What it shows besides."""


@dataclass(frozen=True)
class Margin:
    """Of one metric."""

    relative: float
    """Share of A's mean."""
    floor: float
    """In the metric's unit."""
    rise_is_worse: bool = True

    def of(self, mean_a: float) -> float:
        """In the metric's unit, beside a reference of this mean."""
        return max(self.relative * abs(mean_a), self.floor)


_ANGLE = Margin(0.02, 0.02)
_PLACE = Margin(0.02, 0.1)
_SMOOTH = Margin(0.02, 1.0)
_GROUND = Margin(0.05, 0.5)
_TIME = Margin(0.5, 0.01)
MARGINS = {
    **dict.fromkeys(("joint_angle_mean_deg", "joint_angle_rms_deg", "mpjre_deg", "mpjre_axis_angle_deg"), _ANGLE),
    **dict.fromkeys(("joint_geodesic_global_deg", "sip_error_deg", "root_angle_deg", "root_heading_deg"), _ANGLE),
    **dict.fromkeys(("mpjpe_mm", "mpjpe_root_mm", "mpjpe_pa_mm", "root_position_mm"), _PLACE),
    **dict.fromkeys(("upper_position_mm", "lower_position_mm", "hands_position_mm", "feet_position_mm"), _PLACE),
    **dict.fromkeys(("mpjve_mm_s", "jitter_m_s3"), _SMOOTH),
    **dict.fromkeys(("foot_skate_mm_s", "penetration_mm", "float_mm"), _GROUND),
    **dict.fromkeys(TIME_METRICS, _TIME),
    "fps": Margin(1.0 / 3.0, 1.0, rise_is_worse=False),
}
"""Of every metric that has a better and a worse; the truth's own values, counts and lag have none."""


def margin_of(metric: str) -> Margin:
    """UnknownName for a metric that cannot be gated."""
    if metric not in MARGINS:
        raise UnknownName("metric with a margin", metric, MARGINS)
    return MARGINS[metric]
