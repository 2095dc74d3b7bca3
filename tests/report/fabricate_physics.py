"""Made-up error statistics of two models, and a truth table with rows of every verdict."""

from dataclasses import replace

import numpy as np

from harness.core.seeds import generator
from harness.report.physics.error_comparison import ErrorModelComparison, TrackerErrorStatistics
from harness.results.benchmark_statement import state_verdict

ROWS = (
    state_verdict("static, spread of 3-D position", "1.0 to 2.0 mm", "1.54 mm", True, "1.5 mm RMS"),
    state_verdict(
        "free motion in 1 m³",
        "excursions of 1 to 4 cm for 1 to 10 s in 18 of 20 seeds or more; none above 10 cm with quality above 0",
        "14 of 20 seeds; largest 6.2 cm",
        False,
        "up to 3 cm for several seconds (Gilson et al. 2006)",
        "the gate lets fewer echoes in",
    ),
    state_verdict("four speeds, rest to fast", "RMS rises at each step", "", None),
)


def statistics(label: str = "physics", *, episodes: int = 30) -> TrackerErrorStatistics:
    """Statistics with as many excursions and gaps as asked for."""
    rng = generator(1, "fabricate_physics", label)
    frequency_hz = np.arange(1, 201) / 10.0
    share = np.array([0.01, *[0.01] * 9, 0.90])
    error_m = np.linspace(0.02, 0.002, 10)[:, None] * np.array([1.0, 2.0, 3.0])
    error_m[0] = np.nan
    return TrackerErrorStatistics(
        label=label,
        source=f"made-up errors of {label}",
        recordings=20,
        station_s=7200.0,
        readings=288_000,
        frequency_hz=frequency_hz,
        density_m2_hz=1e-6 / frequency_hz**2,
        segments=600,
        excursion_s=rng.uniform(0.1, 8.0, episodes),
        excursion_peak_m=rng.uniform(0.01, 0.04, episodes),
        gap_s=rng.uniform(0.1, 0.5, episodes),
        truncated=min(episodes, 2),
        quality_share=share,
        class_error_m=error_m,
        error_m=np.array([0.0015, 0.004, 0.012]),
    )


def made_up() -> ErrorModelComparison:
    """Two models, and rows of every verdict."""
    models = (statistics("physics"), statistics("noise = default", episodes=50))
    return ErrorModelComparison(models, ROWS, "harness bench physics --page physics.html", 0.01, 0.5, 10.0)


def without_episodes() -> ErrorModelComparison:
    """One model that has no excursion, no gap and no segment of a spectrum."""
    model = statistics("clean", episodes=0)
    model = replace(model, segments=0, density_m2_hz=np.full(200, np.nan))
    return replace(made_up(), models=(model,), rows=())
