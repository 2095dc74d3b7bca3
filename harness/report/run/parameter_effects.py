"""Effect of a varied key of the scenario on the errors: curves if its values are numbers, and tables."""

from typing import TYPE_CHECKING

from harness.core.text_table import Table
from harness.report.kit.chart import add_legend, draw_chart
from harness.report.kit.highlights import Highlights
from harness.report.kit.markup import Markup, join, tag
from harness.report.kit.style import Chart
from harness.report.kit.table import count_note, html_table
from harness.report.kit.text import to_file_name
from harness.report.run.charts import AXIS_LABELS, omitted_series_note
from harness.report.run.data import Row, RunData
from harness.report.run.tables import summary_cell
from harness.results.cell import varied_text
from harness.score.metrics import DEFINITIONS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def effect_charts(run: RunData, highlights: Highlights) -> list[Chart]:
    """For each behaviour a chart of the error against the varied key; none unless one key takes several numbers."""
    values = [row["varied"] for row in run.full_summary["cells"]]
    keys = {key for varied in values for key in varied}
    if len(keys) != 1 or len({varied_text(varied) for varied in values}) < 2:
        return []
    (key,) = keys
    if not all(isinstance(varied[key], int | float) and not isinstance(varied[key], bool) for varied in values):
        return []
    return [_chart(run, behaviour, key, highlights) for behaviour in run.behaviours]


def effect_tables(run: RunData) -> Markup:
    """For each behaviour and metric a table of methods by varied values; nothing when nothing is varied."""
    if not run.varied_label:
        return Markup()
    return join(*(_table(run, behaviour, metric) for behaviour in run.behaviours for metric in AXIS_LABELS))


def _chart(run: RunData, behaviour: str, key: str, highlights: Highlights) -> Chart:
    by_series = _rows(run, behaviour)
    names = [name for name in run.charted_series if name in by_series]

    def draw(figure: "Figure") -> None:
        styles = highlights.styles(names)
        for axes, (metric, label) in zip(figure.subplots(1, 2), AXIS_LABELS.items(), strict=True):
            for name, style in styles.items():
                points = sorted(
                    (row["varied"][key], row["metrics"][metric]["mean"]) for row in by_series[name].values()
                )
                measured = [(x, y) for x, y in points if y is not None]
                if measured:
                    options = {**style, "marker": style.get("marker") or "o", "markersize": 3.5}
                    axes.plot(*zip(*measured, strict=True), label=name + highlights.role(name), **options)
            axes.set_xlabel(key)
            axes.set_ylabel(label)
            axes.set_ylim(bottom=0.0)
        add_legend(figure, figure.axes[0])

    return draw_chart(
        f"varied_{to_file_name(key)}_{to_file_name(behaviour)}",
        f"{behaviour.replace('_', ' ')}: error against {key}",
        f"Mean over clips; the tables below have the numbers. {highlights.description}{omitted_series_note(run)}",
        f"Joint angle and joint position error of {len(names)} methods against {key}.",
        draw,
        3.6,
        hover=True,
    )


def _table(run: RunData, behaviour: str, metric: str) -> Markup:
    by_series, unit = _rows(run, behaviour), DEFINITIONS[metric].unit
    columns = list(dict.fromkeys(varied_text(row["varied"]) for row in run.full_summary["cells"]))
    rows = []
    for name in run.series:
        if name in by_series:
            row_of = [by_series[name].get(column) for column in columns]
            n = max(row["metrics"][metric]["sequences"] for row in row_of if row)
            cells = [summary_cell(row and row["metrics"][metric], unit, column_n=n) for row in row_of]
            rows.append([join(name, count_note(n)), *cells])
    caption = join(tag("b", f"{behaviour.replace('_', ' ')}, {metric} [{unit}]"), ": mean ± sd over n clips.")
    return html_table(Table(["method", *columns], rows), caption, label=f"{metric} against the varied values")


def _rows(run: RunData, behaviour: str) -> dict[str, dict[str, Row]]:
    """Series -> varied values as text -> row of the full summary."""
    rows: dict[str, dict[str, Row]] = {}
    for row in run.full_summary["behaviours"]:
        if row["behaviour"] == behaviour:
            rows.setdefault(run.series_of(row), {})[varied_text(row["varied"])] = row
    return rows
