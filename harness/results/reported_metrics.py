"""Which metrics tables and pages lead with, and how the text tables print them."""

PRIMARY_METRIC = "joint_angle_mean_deg"
"""The metric that ranks methods."""
MAX_FALLBACK_SHARE = 0.05
"""A method with a larger `fallback_share` says so in its row (choice): its figures are not those of its model."""
SECONDARY_METRIC = "mpjpe_mm"
"""The metric that is reported next to the primary one."""
TABLE_COLUMNS = (
    ("joint angle [deg]", PRIMARY_METRIC, 2),
    ("rotation [deg]", "mpjre_deg", 2),
    ("position [mm]", SECONDARY_METRIC, 1),
    ("jitter [m/s3]", "jitter_m_s3", 0),
    ("step p50 [ms]", "step_p50_ms", 2),
)
"""Columns of the text table of a run: title, metric and decimals."""
