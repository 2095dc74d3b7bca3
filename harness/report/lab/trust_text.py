"""Text of a trust study: the verdict, equivalence, pairs, rank correlations, readings and health."""

from collections.abc import Sequence

from harness.core.number_format import (
    NOT_MEASURED,
    count_noun,
    decimals_for,
    format_fixed,
    format_interval,
    format_p_value,
    format_share,
)
from harness.core.text_table import Table
from harness.report.lab.trust_content import TrustReport
from harness.results.trust_findings import ErrorDistance, RankCorrelation, StationHealth, TrustFindings

EXPLORATORY = "EXPLORATORY: captures were not made for this plan, so that the figures confirm nothing."
_MILLI = {"m": ("mm", 1e3), "rad": ("mrad", 1e3)}
"""Unit of an error -> the one that is printed, and its factor."""


def format_trust(report: TrustReport) -> str:
    """The findings as text; the last line is the reason for the outcome."""
    found = report.findings
    blocks = [
        _head(found),
        _equivalences(found),
        _pairs(found),
        [_correlation(line) for line in found.rank_correlations],
        _distances(found.distances),
        _health(found.health),
        [f"failed: {cell}: {why.strip().splitlines()[-1]}" for cell, why in found.failures.items()],
        [f"lost in {capture.file}: {text}" for capture in found.captures for text in capture.damage],
        list(found.notes),
        [found.why],
    ]
    return "\n\n".join("\n".join(lines) for lines in blocks if lines)


def _head(found: TrustFindings) -> list[str]:
    clips = len({capture.clip for capture in found.captures})
    unit = f"{found.unit} ({found.unit_digest[:12]})" if found.unit_digest else f"noise {found.unit}"
    return [
        *([EXPLORATORY] if found.exploratory else []),
        f"{found.title}: plan {found.plan_digest[:12]}, scenario {found.scenario}, simulated with {unit}",
        f"{count_noun(len(found.captures), 'capture')} of {count_noun(clips, 'clip')}, "
        f"{count_noun(len(found.arms), 'arm')}, {count_noun(len(found.seeds), 'seed')}",
    ]


def _equivalences(found: TrustFindings) -> list[str]:
    rows = []
    for line in found.equivalences:
        decimals = decimals_for(line.margin, digits=2)
        values = [format_fixed(value, decimals) for value in (line.device, line.simulated)]
        difference = format_fixed(line.difference, decimals, signed=True)
        interval = format_interval(line.low, line.high, decimals, signed=True)
        rows.append([line.metric, line.arm, line.verdict, *values, difference, interval, f"{line.margin:g}"])
    head = ["metric", "arm", "verdict", "device", "simulated", "difference", _interval_title(found), "margin"]
    return _titled("Equivalence, simulation minus device over clips", Table(head, rows, text_columns=3))


def _pairs(found: TrustFindings) -> list[str]:
    rows = []
    for pair in found.pairs:
        cells = []
        for side in (pair.device, pair.simulated):
            decimals = decimals_for(side.mean, side.low, side.high, digits=2)
            cells.append(format_fixed(side.mean, decimals, signed=True))
            cells.append(format_interval(side.low, side.high, decimals, signed=True))
        rows.append([pair.a, pair.b, pair.verdict, *cells, format_p_value(pair.p_holm)])
    interval = _interval_title(found)
    head = ["a", "b", "verdict", "device a - b", interval, "simulated a - b", interval, "p (Holm)"]
    return _titled(f"Order of arms by {found.ranked_metric}", Table(head, rows, text_columns=3))


def _interval_title(found: TrustFindings) -> str:
    return f"{100.0 * (1.0 - 2.0 * found.level):g} % interval"


def _correlation(line: RankCorrelation) -> str:
    if line.value is None:
        return f"{line.name}: {NOT_MEASURED} ({line.reason})"
    return f"{line.name}: {line.value:.2f}, 95 % interval {format_interval(line.low, line.high, 2)}"


def _distances(distances: Sequence[ErrorDistance]) -> list[str]:
    rows = []
    for row in distances:
        unit, factor = _MILLI[row.unit]
        figures = [None if value is None else factor * value for value in (row.distance, row.split_half)]
        blocks = f"{row.blocks[0]} and {row.blocks[1]} of {row.block_s:.1f} s" if row.block_s else row.reason
        title = f"{row.feature} [{unit}]"
        cells = [format_fixed(value, 3) for value in figures]
        rows.append([row.station, title, *cells, format_p_value(row.p_holm), blocks])
    head = ["station", "error", "energy distance", "device's halves, 95 %", "p (Holm)", "blocks"]
    return _titled("Errors of the readings on both sides", Table(head, rows, text_columns=2))


def _health(health: Sequence[StationHealth]) -> list[str]:
    rows = []
    for row in health:
        sides = [
            [
                f"{side.rate_hz:.2f}",
                format_share(side.lost_share, 1),
                f"{side.gaps_per_min:.1f}",
                format_fixed(side.gap_s, 2),
                f"{side.quality:.2f}",
                format_share(side.suspect_share, 1),
            ]
            for side in (row.device, row.simulated)
        ]
        rows.append([row.station, *(" | ".join(pair) for pair in zip(*sides, strict=True))])
    head = ["station", "rate [Hz]", "lost", "gaps/min", "gap [s]", "quality", "suspect"]
    return _titled("Health of the streams, device | simulated", Table(head, rows))


def _titled(title: str, table: Table) -> list[str]:
    return [title, "", *table.lines()] if table.rows else []
