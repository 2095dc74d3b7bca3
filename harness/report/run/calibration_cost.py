"""How much calibration errors increase each method's error, paired by unit; nothing unless calibration is varied."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from harness.compare.paired_statistics import PairedDifference, compare_paired
from harness.compare.units import Sampling, average_units
from harness.core.number_format import NOT_MEASURED, Interval, format_fixed
from harness.core.text_table import Table
from harness.report.kit.markup import Markup, join, tag
from harness.report.kit.table import html_table
from harness.results.cell import varied_text

_EXACT = "exact"
_METRICS = (("joint angle [deg]", "joint_angle_mean_deg", 2), ("mpjpe_pa [mm]", "mpjpe_pa_mm", 1))
"""Title, metric and decimals; positions are Procrustes-aligned, which leaves out the error of the room."""
_TITLE = "cost of calibration"
_CAPTION = (
    "error with exact calibration, then for each other calibration the mean increase over units and its paired 95 % "
    "interval (docs/studies.md)"
)


def cost_table(cells: Sequence[Mapping[str, Any]], sampling: Sampling) -> Table | None:
    """A row for each method and metric; None unless both exact and other calibrations were measured."""
    groups: dict[tuple[str, ...], dict[str, list[Mapping[str, Any]]]] = {}
    for cell in cells:
        others = {key: value for key, value in cell["varied"].items() if key != "calibration"}
        setting = (cell["behaviour"], cell["performer"], cell["inputs"], varied_text(others), cell["method"])
        by_kind = groups.setdefault(tuple(map(str, setting)), {})
        by_kind.setdefault(str(cell["calibration"]), []).append(cell)
    kinds = list(dict.fromkeys(kind for group in groups.values() for kind in group))
    if _EXACT not in kinds or len(kinds) == 1:
        return None
    kinds.remove(_EXACT)
    shown = [i for i in range(5) if i in (0, 4) or len({setting[i] for setting in groups}) > 1]
    titles = ("behaviour", "performer", "inputs", "varied", "method")
    head = [*(titles[i] for i in shown), "error", _EXACT, *kinds]
    rows = []
    for names, group in groups.items():
        for title, metric, decimals in _METRICS:
            by_clip = {kind: {str(cell["clip"]): cell[metric] for cell in group.get(kind, [])} for kind in group}
            exact = by_clip.get(_EXACT, {})
            errors = average_units({clip: error for clip, error in exact.items() if error is not None}, sampling)
            mean = format_fixed(float(np.mean(list(errors.values()))) if errors else None, decimals)
            costs = [_format_cost(compare_paired(by_clip.get(kind, {}), exact, sampling)) for kind in kinds]
            rows.append([*(names[i] for i in shown), title, mean, *costs])
    return Table(head, rows, text_columns=len(head))


def text(summary: Mapping[str, Any]) -> list[str]:
    """The table as lines for the terminal."""
    table = cost_table(summary.get("cells", []), Sampling.of_summary(summary))
    return [f"{_TITLE}: {_CAPTION}", "", *table.lines(), ""] if table else []


def section(cells: Sequence[Mapping[str, Any]], sampling: Sampling) -> Markup:
    """The table for the page."""
    table = cost_table(cells, sampling)
    caption = join(tag("b", _TITLE.capitalize()), f": {_CAPTION}.")
    return html_table(table, caption, label=_TITLE) if table else Markup()


def _format_cost(increase: PairedDifference) -> str:
    if increase.mean is None:
        return NOT_MEASURED
    number = Interval.of(increase.mean, increase.low, increase.high, signed=True)
    return str(number) if increase.low is not None else f"{number} ({increase.why})"
