"""What calibrating costs each method beside knowing everything, clip by clip; none unless a run varies calibration."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from harness.compare.paired_statistics import compare_paired
from harness.report.kit.markup import Markup, join, table, tag
from harness.report.run.calibration_errors import align_left
from harness.results.cell import varied_text

_EXACT = "exact"
_METRICS = (("joint angle [deg]", "joint_angle_mean_deg", 2), ("mpjpe_pa [mm]", "mpjpe_pa_mm", 1))
"""Title, metric and decimals; positions without the room's error, which is another matter."""
_CAPTION = "beside exact: mean difference over clips and its paired 95 % interval (docs/methods.md H17)"


def table_rows(cells: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    """The table's cells, head first; empty when not both exact and other calibrations were measured."""
    groups: dict[tuple[str, ...], dict[str, list[Mapping[str, Any]]]] = {}
    for cell in cells:
        others = {key: value for key, value in cell["varied"].items() if key != "calibration"}
        place = (cell["behaviour"], cell["performer"], cell["inputs"], varied_text(others), cell["method"])
        groups.setdefault(tuple(map(str, place)), {}).setdefault(str(cell["calibration"]), []).append(cell)
    kinds = list(dict.fromkeys(kind for group in groups.values() for kind in group))
    if _EXACT not in kinds or len(kinds) == 1:
        return []
    kinds.remove(_EXACT)
    named = [i for i in range(5) if i in (0, 4) or len({setting[i] for setting in groups}) > 1]
    titles = ("behaviour", "performer", "inputs", "varied", "method")
    found = [[*(titles[i] for i in named), "error", _EXACT, *kinds]]
    for setting, group in groups.items():
        for title, metric, decimals in _METRICS:
            by_clip = {kind: {str(cell["clip"]): cell[metric] for cell in group.get(kind, [])} for kind in group}
            exact = by_clip.get(_EXACT, {})
            known = [error for error in exact.values() if error is not None]
            mean = f"{np.mean(known):.{decimals}f}" if known else "not measured"
            costs = [_format_cost(by_clip.get(kind, {}), exact, decimals) for kind in kinds]
            found.append([*(setting[i] for i in named), title, mean, *costs])
    return found


def text(summary: Mapping[str, Any]) -> list[str]:
    """Lines for the terminal."""
    found = table_rows(summary.get("cells", []))
    if not found:
        return []
    return [f"what calibrating costs, {_CAPTION}", "", *align_left(found), ""]


def section(cells: Sequence[Mapping[str, Any]]) -> Markup:
    """The same for the page."""
    found = table_rows(cells)
    if not found:
        return Markup()
    head, *rows = found
    caption = join(tag("b", "What calibrating costs"), f", {_CAPTION}")
    return table(caption, head, rows, label="what calibrating costs")


def _format_cost(errors: Mapping[str, float | None], exact: Mapping[str, float | None], decimals: int) -> str:
    found = compare_paired(errors, exact)
    if found.mean is None:
        return "not measured"
    ends = "too few clips" if found.low is None else f"{found.low:+.{decimals}f} to {found.high:+.{decimals}f}"
    return f"{found.mean:+.{decimals}f} ({ends})"
