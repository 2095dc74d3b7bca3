"""Which metrics tables and pages lead with."""

PRIMARY_METRIC = "joint_angle_mean_deg"
"""The metric that ranks methods."""
MAX_FALLBACK_SHARE = 0.05
"""A method with a larger `fallback_share` says so in its row (choice): its figures are not those of its model."""
SECONDARY_METRIC = "mpjpe_mm"
"""The metric that is reported next to the primary one."""
