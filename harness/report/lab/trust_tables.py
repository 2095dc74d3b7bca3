"""The tables of a trust study, for its page and for the terminal."""

import math

from harness.core.number_format import NOT_MEASURED, format_fixed, format_interval, format_p_value, format_share
from harness.core.text_table import Table
from harness.report.lab.trust_wording import (
    EQUIVALENCE_MARKS,
    PAIR_MARKS,
    equivalence_decimals,
    interval_title,
    metric_title,
    pair_title,
    side_interval,
    side_text,
    sort_equivalences,
    sort_pairs,
)
from harness.results.trust_findings import ErrorDistance, StreamHealth, TrustFindings

_UNITS = {"m": ("mm", 1e3), "rad": ("deg", math.degrees(1.0))}
"""Unit of an error -> the one that is shown, and its factor."""
_HEALTH = ("rate [Hz]", "frames lost", "gaps per minute", "mean gap [s]", "mean quality", "frames in doubt")


def pairs_table(findings: TrustFindings) -> Table:
    """Both sides of each pair, contradictions first."""
    rows = [
        [
            pair_title(pair),
            f"{PAIR_MARKS[pair.verdict]} {pair.verdict}",
            side_text(pair.device),
            side_interval(pair.device),
            side_text(pair.simulated),
            side_interval(pair.simulated),
            format_p_value(pair.p_holm),
            str(pair.clips),
            pair.why,
        ]
        for pair in sort_pairs(findings.pairs)
    ]
    interval = interval_title(findings)
    head = ["pair", "verdict", "device", interval, "simulation", interval, "p (Holm)", "units", "because"]
    return Table(head, rows, 2)


def equivalence_table(findings: TrustFindings) -> Table:
    """Simulation minus device of each metric of each arm, those beyond the margin first."""
    rows = []
    for one in sort_equivalences(findings.equivalences):
        decimals = equivalence_decimals(one)
        rows.append(
            [
                one.arm,
                metric_title(one.metric),
                f"{EQUIVALENCE_MARKS[one.verdict]} {one.verdict}",
                format_fixed(one.device, decimals),
                format_fixed(one.simulated, decimals),
                NOT_MEASURED if one.difference is None else format_fixed(one.difference, decimals, signed=True),
                format_interval(one.low, one.high, decimals, signed=True) or "–",
                format_fixed(one.margin, decimals),
                str(one.clips),
            ]
        )
    head = [
        "method",
        "metric",
        "verdict",
        "device",
        "simulation",
        "difference",
        interval_title(findings),
        "margin",
        "units",
    ]
    return Table(head, rows, 3)


def distances_table(findings: TrustFindings) -> Table:
    """Energy distance of each station and error beside the device's own."""
    rows = []
    for one in findings.distances:
        unit, factor = _UNITS.get(one.unit, (one.unit, 1.0))
        rows.append(
            [
                one.station,
                f"{one.feature} [{unit}]",
                _distance(one.distance, factor),
                _distance(one.split_half, factor),
                format_p_value(one.p_holm),
                f"{one.blocks[0]} and {one.blocks[1]} of {format_fixed(one.block_s, 1)} s",
                one.reason or distance_meaning(one, findings.level),
            ]
        )
    return Table(["station", "error", "distance", "device's own", "p (Holm)", "blocks", "meaning"], rows, 2)


def distance_meaning(one: ErrorDistance, level: float) -> str:
    """Whether the errors differ, and whether by more than halves of the device's own captures do."""
    if one.distance is None or one.split_half is None or one.p_holm is None:
        return NOT_MEASURED
    if one.p_holm > level:
        return "no difference shown"
    return "differs" if one.distance > one.split_half else "differs by less than halves of the device's data do"


def _distance(value: float | None, factor: float) -> str:
    return NOT_MEASURED if value is None else f"{factor * value:.3g}".replace("-", "−")


def health_table(findings: TrustFindings) -> Table:
    """Stream health of each station on both sides, one below the other."""
    rows = [
        [row.station, side, *_health_cells(health)]
        for row in findings.health
        for side, health in (("device", row.device), ("simulation", row.simulated))
    ]
    return Table(["station", "side", *_HEALTH], rows, 2)


def _health_cells(health: StreamHealth) -> list[str]:
    return [
        format_fixed(health.rate_hz, 2),
        format_share(health.lost_share, 2),
        format_fixed(health.gaps_per_min, 2),
        "–" if health.gap_s is None else format_fixed(health.gap_s, 3),
        format_fixed(health.quality, 3),
        format_share(health.suspect_share, 2),
    ]


def captures_table(findings: TrustFindings) -> Table:
    """The captures, and whether each names this plan."""
    rows = [
        [
            capture.file,
            capture.clip,
            f"{capture.frames:,}",
            "yes" if capture.plan == findings.plan_digest else "another plan" if capture.plan else "no plan",
            capture.sha256[:12],
        ]
        for capture in findings.captures
    ]
    return Table(["capture", "motion", "frames", "made for this plan", "SHA-256 begins"], rows, 2)
