"""A made-up unit as `harness characterize` reports one: known numbers, two faults, every kind of section."""

from dataclasses import replace

import numpy as np

from harness.core.number_format import Interval
from harness.core.seeds import generator
from harness.measure.departures import Departure, compare_with_expected
from harness.measure.profile import QualityClass, StretchLength
from harness.measure.rigid_pair import RigidPair, SpeedClass
from harness.measure.unit_report import (
    CaptureSummary,
    DensityCurve,
    DeviationCurve,
    EpisodeMark,
    ParameterRow,
    RecordingAdvice,
    StationFigures,
    UnitReport,
)

STATIONS = ("head", "pelvis", "left_wrist", "right_wrist", "left_foot", "right_foot")
TOO_FEW = "4 gaps are too few: 20 are needed."


def exact(value: float) -> Interval:
    """A number that is known exactly."""
    return Interval(value, value, value)


def number(value: float, share: float, count: int = 100) -> Interval:
    """A number whose interval reaches a share of it to both sides."""
    return Interval(value, value * (1.0 - share), value * (1.0 + share), count)


MEASURED = {
    "components.white.position_m": (number(0.0015, 0.02, 48_000), 0.00075),
    "components.white.orientation_rad": (number(0.00087, 0.02, 48_000), 0.000873),
    "components.drift.position_m": (number(0.00152, 0.05, 4000), 0.0015),
    "components.drift.correlation_s": (number(0.98, 0.08, 4000), 1.0),
    "components.excursion.onsets_per_min": (number(3.1, 0.12, 372), 1.0),
    "components.excursion.size_m.0": (number(0.0052, 0.1, 372), 0.005),
    "components.excursion.size_m.1": (number(0.0298, 0.02, 372), 0.03),
    "components.echo.share": (number(0.0304, 0.05, 2011), 0.03),
    "components.dropout.tilt_rad": (Interval.missing(TOO_FEW), 0.00436),
}
TIMING = {
    "timing.rate_hz": (number(40.0, 0.0001, 288_000), 40.0),
    "components.clock.drift_ppm": (Interval(-21.0, -23.5, -18.5, 900), 20.0),
    "timing.duplicate_share": (exact(0.0), 0.0),
    "timing.stamp_resolution_s": (exact(6.1e-5), None),
}


def checks() -> tuple[Departure, ...]:
    """Checks of the parameters: white noise and rate of excursions depart, and one station's excursions."""
    made = [
        compare_with_expected(key, "", measured, exact(default))
        for key, (measured, default) in MEASURED.items()
        if measured.is_measured
    ]
    made.append(compare_with_expected("components.excursion.onsets_per_min", "head", number(6.0, 0.2), exact(1.0)))
    return tuple(replace(one, p_holm=min(1.0, len(made) * one.p)) for one in made)


def made_up_unit() -> UnitReport:
    """A unit with two faults, and something to show in every section."""
    rng = generator(1, "fabricate_lab")
    tau_s = np.geomspace(0.025, 200.0, 24)
    allan = np.hypot(0.0015 * np.sqrt(0.025 / tau_s), 0.0010 / (tau_s / 1.9 + 1.9 / tau_s))
    hz = np.geomspace(0.02, 20.0, 300)
    density = 3.0 * (0.0015**2 * 0.05 + 4.0 * 0.0015**2 / (1.0 + (2.0 * np.pi * hz) ** 2))

    def curve(station: str) -> DeviationCurve:
        here = allan * rng.lognormal(0.0, 0.03, len(tau_s))
        wide = np.minimum(0.02 + 0.3 * tau_s / 200.0, 0.5)
        return DeviationCurve(station, tau_s, here, here * (1.0 - wide), here * (1.0 + wide))

    nothing = np.full(len(tau_s), np.nan)
    return UnitReport(
        name="lab",
        capture=CaptureSummary(
            "lab.is900rec",
            1790.0,
            STATIONS,
            40.0,
            (
                StretchLength("static", 1200.0, 288_000),
                StretchLength("slow", 240.0, 57_600),
                StretchLength("fast", 120.0, 28_800),
                StretchLength("covered", 120.0, 28_800),
            ),
            ("The last 312 bytes are not a whole block; 0.2 s are lost.",),
        ),
        expected_from="the preset default",
        parameters=tuple(ParameterRow(key, *numbers) for key, numbers in MEASURED.items()),
        timing=tuple(ParameterRow(key, *numbers) for key, numbers in TIMING.items()),
        checks=checks(),
        stations=tuple(_figures(station, n) for n, station in enumerate(STATIONS)),
        allan_position=tuple(curve(station) for station in STATIONS),
        allan_orientation=tuple(curve(station) for station in STATIONS[:2]),
        allan_position_model=DeviationCurve("fitted model", tau_s, allan, nothing, nothing),
        spectra=tuple(DensityCurve(station, hz, density * rng.lognormal(0.0, 0.15, len(hz))) for station in STATIONS),
        episodes=_episodes(rng),
        quality=(
            QualityClass(0.0, 0.0, 0.01, np.nan, np.nan),
            *(
                QualityClass(low, low + 0.1, share, 0.01 * (1.1 - low), 0.02 * (1.1 - low))
                for low, share in zip(np.arange(10) / 10.0, [*[0.01] * 9, 0.90], strict=True)
            ),
        ),
        advice=(
            RecordingAdvice("components.excursion.onsets_per_min", 0.2, 372, 97, 20.0, 5.2),
            RecordingAdvice("components.dropout.share", 0.2, 4, 97, 20.0, 485.0),
            RecordingAdvice("components.dropout.gap_s", 0.2, 0, 97, 20.0, np.nan),
        ),
        rigid_pairs=(made_up_pair(),),
        notes=("Latency cannot be told without a reference: harness validate measures it.",),
    )


def made_up_pair() -> RigidPair:
    """Two stations on a bar whose error grows with speed."""
    speeds = tuple(
        SpeedClass(low, high, number(0.002 + 0.002 * low, 0.1, 12))
        for low, high in ((0.0, 0.05), (0.05, 0.25), (0.25, 0.5), (0.5, 1.0), (1.0, 2.0))
    )
    return RigidPair(
        ("left_wrist", "right_wrist"), number(0.4, 0.001, 20), number(0.01, 0.1, 20), number(0.002, 0.2, 20), speeds
    )


def without_content() -> UnitReport:
    """A unit of which hardly anything was measured."""
    missing = tuple(ParameterRow(key, Interval.missing(TOO_FEW), default) for key, (_, default) in MEASURED.items())
    return UnitReport(
        "lab", CaptureSummary("lab.is900rec", 30.0, STATIONS[:1], 40.0),
        "the preset default", missing, (), (), (),
    )  # fmt: skip


def without_faults() -> UnitReport:
    """A unit without a departure."""
    good = tuple(replace(check, p_holm=1.0) for check in checks())
    return replace(made_up_unit(), checks=good)


def _figures(station: str, n: int) -> StationFigures:
    return StationFigures(
        station,
        {
            "spread_m": number(0.0029 + 1e-4 * n, 0.03),
            "spread_rad": number(0.0101, 0.03),
            "white_m": number(0.0015, 0.02),
            "slow_m": number(0.0015, 0.05),
            "excursions_per_min": number(6.0 if station == "head" else 3.0, 0.3, 60),
            "gap_share": number(0.01, 0.3),
            "rate_hz": number(40.0, 0.0001),
            "jitter_s": number(0.00002, 0.1),
            "lost_share": exact(0.0),
            "duplicate_share": exact(0.0) if n else Interval.missing("no stamps"),
        },
    )


def _episodes(rng: np.random.Generator) -> tuple[EpisodeMark, ...]:
    kinds = {"excursion": (60, 1.0, 5.0, 0.03), "echo": (335, 0.025, 0.2, 0.3), "gap": (4, 0.1, 0.5, np.nan)}
    return tuple(
        EpisodeMark(station, kind, float(rng.uniform(0.0, 1190.0)), float(rng.uniform(short, long)), size)
        for station in STATIONS
        for kind, (count, short, long, size) in kinds.items()
        for _ in range(count)
    )
