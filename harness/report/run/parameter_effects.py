"""What the error comes to when a key of the scenario is varied: a curve where its values are numbers, and the table."""

from typing import TYPE_CHECKING, Any

from harness.report.kit.markup import Markup, join, table, tag
from harness.report.kit.style import Chart, line_style
from harness.report.run.charts import UNITS, add_legend, draw_chart, omitted_series_note
from harness.report.run.data import Row, RunData, to_file_name
from harness.report.run.tables import format_count, format_statistics
from harness.results.cell import varied_text
from harness.score.metrics import DEFINITIONS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def effect_charts(run: RunData) -> list[Chart]:
    """For each behaviour the error against the varied key; none unless a single key takes several numbers."""
    values = [row["varied"] for row in run.full_summary["cells"]]
    keys = {key for varied in values for key in varied}
    if len(keys) != 1 or len({varied_text(varied) for varied in values}) < 2:
        return []
    (key,) = keys
    if not all(isinstance(varied[key], int | float) and not isinstance(varied[key], bool) for varied in values):
        return []
    return [_chart(run, behaviour, key) for behaviour in run.behaviours]


def effect_tables(run: RunData) -> Markup:
    """Every method against every combination of values, behaviour by behaviour; nothing when nothing is varied."""
    if not run.varied_label:
        return Markup()
    return join(*(_table(run, behaviour, metric) for behaviour in run.behaviours for metric in UNITS))


def _chart(run: RunData, behaviour: str, key: str) -> Chart:
    found = _rows(run, behaviour)
    names = [name for name in run.charted_series if name in found]

    def draw(figure: "Figure") -> None:
        for axes, (metric, unit) in zip(figure.subplots(1, 2), UNITS.items(), strict=True):
            for name in names:
                points = sorted((row["varied"][key], row["metrics"][metric]["mean"]) for row in found[name].values())
                measured = [(x, y) for x, y in points if y is not None]
                if measured:
                    axes.plot(*zip(*measured, strict=True), "o", markersize=3.5, **_line_options(run, name))
            axes.set_xlabel(key)
            axes.set_ylabel(unit)
            axes.set_ylim(bottom=0.0)
        add_legend(figure, figure.axes[0])

    return draw_chart(
        f"varied_{to_file_name(key)}_{to_file_name(behaviour)}",
        f"{behaviour.replace('_', ' ')}: error against {key}",
        f"Mean over clips; the table below has the numbers.{omitted_series_note(run)}",
        f"Joint angle and joint position error of {len(names)} methods against {key}.",
        draw,
        3.6,
    )


def _line_options(run: RunData, name: str) -> dict[str, Any]:
    return {"label": name, **line_style(run.charted_series.index(name))}


def _table(run: RunData, behaviour: str, metric: str) -> Markup:
    found, unit = _rows(run, behaviour), DEFINITIONS[metric].unit
    columns = list(dict.fromkeys(varied_text(row["varied"]) for row in run.full_summary["cells"]))
    rows = []
    for name in run.series:
        if name in found:
            each = [found[name].get(column) for column in columns]
            n = max(row["metrics"][metric]["sequences"] for row in each if row)
            rows.append(
                [
                    join(name, format_count(n)),
                    *(format_statistics(row and row["metrics"][metric], unit, n=n) for row in each),
                ]
            )
    caption = join(tag("b", f"{behaviour.replace('_', ' ')}, {metric} [{unit}]"), ": mean ± sd over n clips.")
    return table(caption, ["method", *columns], rows, label=f"{metric} against the varied values")


def _rows(run: RunData, behaviour: str) -> dict[str, dict[str, Row]]:
    """Series -> varied values as text -> its row of the whole summary."""
    found: dict[str, dict[str, Row]] = {}
    for row in run.full_summary["behaviours"]:
        if row["behaviour"] == behaviour:
            found.setdefault(run.series_of(row), {})[varied_text(row["varied"])] = row
    return found
