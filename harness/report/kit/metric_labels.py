"""Names of metrics in axis labels and table heads: the quantity in words, and its unit."""

from harness.score.metrics import DEFINITIONS

_QUANTITIES = {
    "joint_angle_mean_deg": "joint angle error",
    "joint_angle_rms_deg": "RMS joint angle error",
    "mpjre_deg": "joint rotation error",
    "mpjre_axis_angle_deg": "axis-angle error",
    "joint_geodesic_global_deg": "global rotation error",
    "sip_error_deg": "SIP error",
    "root_angle_deg": "root orientation error",
    "root_heading_deg": "root heading error",
    "mpjpe_mm": "joint position error",
    "mpjpe_root_mm": "joint position error, roots aligned",
    "mpjpe_pa_mm": "joint position error, rigidly aligned",
    "root_position_mm": "root position error",
    "root_drift_mm_s": "root drift",
    "upper_position_mm": "position error of the upper body",
    "lower_position_mm": "position error of the lower body",
    "hands_position_mm": "position error of the hands",
    "feet_position_mm": "position error of the feet",
    "mpjve_mm_s": "joint velocity error",
    "jitter_m_s3": "jitter",
    "jitter_true_m_s3": "true jitter",
    "foot_skate_mm_s": "foot skate",
    "foot_skate_true_mm_s": "true foot skate",
    "penetration_mm": "ground penetration",
    "penetration_true_mm": "true ground penetration",
    "float_mm": "height above ground",
    "float_true_mm": "true height above ground",
    "lag_ms": "lag",
    "step_mean_ms": "mean step time",
    "step_p50_ms": "median step time",
    "step_p95_ms": "step time, 95th percentile",
    "step_p99_ms": "step time, 99th percentile",
    "first_step_ms": "time of the first step",
    "fps": "frame rate",
    "step_relative": "relative step time",
    "coverage": "coverage",
    "fallback_share": "fallbacks",
}
"""Metric -> quantity; others are called by their name."""


def metric_name(metric: str) -> str:
    """The quantity of a metric in words, such as "joint angle error"."""
    return _QUANTITIES.get(metric, metric.replace("_", " "))


def metric_label(metric: str) -> str:
    """The quantity and its unit, "joint angle error [deg]", as axes and heads of tables show them."""
    return f"{metric_name(metric)} [{DEFINITIONS[metric].unit}]"
