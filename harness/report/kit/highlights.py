"""Which series of a chart with many lines are in colour: the leader and one control; the others are grey."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from harness.report.kit.style import COLOURS, DASHES, muted_line_style

CONTROL = "ik"
"""The control unless another one is chosen: inverse kinematics without a model of the motion."""
_LEADER: Mapping[str, Any] = {"color": COLOURS[1], "linestyle": "solid", "linewidth": 1.3, "zorder": 4}
_CONTROL: Mapping[str, Any] = {"color": COLOURS[0], "linestyle": DASHES[1], "linewidth": 1.1, "zorder": 3}
_OTHER: Mapping[str, Any] = {"linewidth": 0.8, "zorder": 2}


@dataclass(frozen=True)
class Highlights:
    """The series in colour."""

    leader: str
    """The series with the lowest mean error."""
    control: str | None
    """The series that it is shown against; None if there is no other."""

    def role(self, series: str) -> str:
        """What a legend adds to the name of a series."""
        return {self.leader: " (lowest mean)", self.control: " (control)"}.get(series, "")

    def order(self, series: Iterable[str]) -> list[str]:
        """The series in the order of a legend: the leader, the control, the others."""
        names = list(series)
        first = [name for name in (self.leader, self.control) if name in names]
        return [*first, *(name for name in names if name not in first)]

    def styles(self, series: Iterable[str]) -> dict[str, dict[str, Any]]:
        """Style of the line of each series, in the order of the legend; no two series look the same."""
        coloured = {self.leader: _LEADER, self.control: _CONTROL}
        names = self.order(series)
        others = [name for name in names if name not in coloured]
        return {
            name: {**coloured[name]} if name in coloured else {**muted_line_style(others.index(name)), **_OTHER}
            for name in names
        }

    @property
    def description(self) -> str:
        """Sentences of a caption on the coloured lines, and why they are coloured."""
        leader = f"Blue: {self.leader}, the lowest mean error over all clips."
        if self.control is None:
            return leader
        is_control = self.control == CONTROL or self.control.startswith(f"{CONTROL} (")
        why = "the control: inverse kinematics, which other methods have to beat" if is_control else "the control"
        return f"{leader} Orange, dashed: {self.control}, {why}."


def choose_highlights(ranked: Sequence[str], wanted: str = CONTROL) -> Highlights:
    """The first of the ranked series as the leader, and as its control the wanted method or else the second one."""
    leader, *others = ranked
    return Highlights(leader, next(iter(find_series(others, wanted) or others), None))


def find_series(series: Iterable[str], method: str) -> list[str]:
    """The series of a method: those of its name, with or without qualifiers in brackets."""
    return [name for name in series if name == method or name.startswith(f"{method} (")]
