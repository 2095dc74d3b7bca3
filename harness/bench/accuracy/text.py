"""Text and JSON of the accuracy benchmark."""

from collections.abc import Iterator
from typing import Any

from harness.bench.accuracy.clip_errors import JITTER, POSITION, SKATE, TRUE_JITTER, TRUE_SKATE, ErrorsByCondition
from harness.bench.accuracy.measurement import AccuracyReport
from harness.bench.accuracy.targets import mean_of
from harness.bench.limits import count_missed
from harness.core.number_format import count_noun
from harness.core.text_table import Table
from harness.report.kit import format_statements


def format_report(report: AccuracyReport) -> str:
    """Format a report as text tables."""
    if report.failures:
        lines = [f"{cell}: {failure.strip().splitlines()[-1]}" for cell, failure in report.failures.items()]
        return "\n".join([*lines, f"{count_noun(len(lines), 'cell')} failed, so nothing is compared."])
    return "\n\n".join(_sections(report))


def _sections(report: AccuracyReport) -> Iterator[str]:
    yield f"{report.method} against {report.stored_title}: joint angle [deg], mean over clips, seeds averaged first"
    yield "\n".join(("position, jitter and foot skate:", *_motion_table(report).lines()))
    yield "\n".join(_ranking_lines(report))
    yield "\n".join(format_statements(report.statements))
    if report.no_lag:
        yield f"two frames of lag: not measured ({report.no_lag})"
    yield count_missed(report.statements)


def _motion_table(report: AccuracyReport) -> Table:
    """Position, jitter over the truth's, and foot skate by condition, of the stored errors and of today's."""
    head = ["condition", "method", "position [mm]", "jitter/truth", "foot skate [mm/s]", "truth's"]
    today = {name: by_clip for name, by_clip in report.by_method[report.method].items() if name in report.stored}
    sides = {report.stored_title: report.stored, report.method: today}
    rows = [
        [condition, name, *_motion_cells(errors, condition)] for condition in today for name, errors in sides.items()
    ]
    return Table(head, rows, text_columns=2)


def _motion_cells(errors: ErrorsByCondition, condition: str) -> list[str]:
    position, jitter, true_jitter, skate, true_skate = (
        mean_of(errors.get(condition, {}), metric) for metric in (POSITION, JITTER, TRUE_JITTER, SKATE, TRUE_SKATE)
    )
    return [f"{position:.1f}", f"{jitter / true_jitter:.2f}", f"{skate:.0f}", f"{true_skate:.0f}"]


def _ranking_lines(report: AccuracyReport) -> Iterator[str]:
    """One line for each ranking, the lowest mean first."""
    for (performer, noise), ranking in report.rankings.items():
        order = ", ".join(f"{name} {mean:.2f}" for name, mean in ranking.means.items())
        best = f"{ranking.best} is better than every other one" if ranking.best else "no method is best"
        yield f"{performer} performers, {noise}, {count_noun(len(ranking.clips), 'clip')}: {order}; {best}"


def report_content(report: AccuracyReport) -> dict[str, Any]:
    """The content of the JSON output; errors are means over seeds."""
    return {
        "method": report.method,
        "stored": report.stored_title,
        "quick": report.quick,
        "failures": dict(report.failures),
        "rows": [statement.as_dict() for statement in report.statements],
        "no_lag": report.no_lag,
        "rankings": [
            {"performers": performer, "noise": noise, "means_deg": ranking.means, "best": ranking.best}
            for (performer, noise), ranking in report.rankings.items()
        ],
        "clips": {
            name: {
                condition: {clip: {metric: e.mean(metric) for metric in e.by_metric} for clip, e in by_clip.items()}
                for condition, by_clip in errors.items()
            }
            for name, errors in report.by_method.items()
        },
    }
