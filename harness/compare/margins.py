"""The largest difference of each metric without practical importance, and the metrics that are gated.

Margins are relative to the mean of the reference, with a floor for means near zero. docs/studies.md derives them.
"""

from dataclasses import dataclass

from harness.errors import UnknownName

GATED_METRICS = ("joint_angle_mean_deg", "mpjpe_mm", "jitter_m_s3", "step_relative")
"""Metrics that decide the outcome of a comparison by default."""
TIME_METRICS = ("step_relative", "step_mean_ms", "step_p50_ms", "step_p95_ms", "step_p99_ms", "fps")
"""Step times, comparable on one processor only; even the relative one differs by a fifth between processors."""
INFORMATIVE_METRICS = ("mpjre_deg", "mpjpe_root_mm", "foot_skate_mm_s")
"""Metrics that a comparison also shows."""


@dataclass(frozen=True)
class Margin:
    """Margin of one metric."""

    relative: float
    """Share of the mean of A."""
    floor: float
    """Least margin, in the metric's unit."""
    rise_is_worse: bool = True

    def of(self, mean_a: float) -> float:
        """The margin for a reference with this mean, in the metric's unit."""
        return max(self.relative * abs(mean_a), self.floor)


_ANGLE = Margin(0.02, 0.02)
_POSITION = Margin(0.02, 0.1)
_DYNAMICS = Margin(0.02, 1.0)
_CONTACT = Margin(0.05, 0.5)
_TIME = Margin(0.5, 0.01)
MARGINS = {
    **dict.fromkeys(("joint_angle_mean_deg", "joint_angle_rms_deg", "mpjre_deg", "mpjre_axis_angle_deg"), _ANGLE),
    **dict.fromkeys(("joint_geodesic_global_deg", "sip_error_deg", "root_angle_deg", "root_heading_deg"), _ANGLE),
    **dict.fromkeys(("mpjpe_mm", "mpjpe_root_mm", "mpjpe_pa_mm", "root_position_mm"), _POSITION),
    **dict.fromkeys(("upper_position_mm", "lower_position_mm", "hands_position_mm", "feet_position_mm"), _POSITION),
    **dict.fromkeys(("mpjve_mm_s", "jitter_m_s3"), _DYNAMICS),
    **dict.fromkeys(("foot_skate_mm_s", "penetration_mm", "float_mm"), _CONTACT),
    **dict.fromkeys(TIME_METRICS, _TIME),
    "fps": Margin(1.0 / 3.0, 1.0, rise_is_worse=False),
}
"""Metric -> margin; values of the truth, counts and `lag_ms` have none, since neither direction is better."""


def margin_of(metric: str) -> Margin:
    """The margin of a metric; UnknownName for a metric that cannot be gated."""
    if metric not in MARGINS:
        raise UnknownName("metric with a margin", metric, MARGINS)
    return MARGINS[metric]
