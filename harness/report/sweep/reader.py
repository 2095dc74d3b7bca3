"""A sweep read from its index: every finished cell, as far as its page needs it."""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.arrays import Ints
from harness.report.sweep.data import METRICS, SweepData, VariedKey
from harness.results.cell import varied_text
from harness.results.index import CellIndex

_GROUP_COLUMNS = ("inputs", "split", "performer")
"""Never pooled, the performer last: a method has a series for each combination of them that it has."""
_COLUMNS = ("scenario", "clip", "method", *_GROUP_COLUMNS, "varied", *METRICS)


def read_sweep(out: Path) -> SweepData:
    """Everything that is finished in the folder of a sweep, also while it runs; BadFile when it is none."""
    with CellIndex(out, read_only=True) as index:
        counts, failures, facts = index.counts(), index.failures(), index.facts()
        return collect_cells(
            index.columns(*_COLUMNS),
            name=str(facts.get("name", out.name)),
            planned=counts.planned,
            failures=failures,
            command=str(facts.get("command", "")),
        )


def collect_cells(
    cells: Iterable[Sequence[Any]], *, name: str, planned: int, failures: Mapping[str, str], command: str = ""
) -> SweepData:
    """From the index's columns, a cell at a time."""
    scenarios, clips, groups, values = _LabelEncoder(), _LabelEncoder(), _LabelEncoder(), _LabelEncoder()
    codes: list[tuple[int, int, int, int]] = []
    figures: list[Sequence[float | None]] = []
    for scenario, clip, method, *telling in cells:
        group = (method, *telling[: len(_GROUP_COLUMNS)])
        varied, *metrics = telling[len(_GROUP_COLUMNS) :]
        clip_code = clips.code(f"{scenario}: {clip}")
        codes.append((scenarios.code(scenario), clip_code, groups.code(group), values.code(varied)))
        figures.append(metrics)
    scenario_of, clip_of, series_of, varied_of = np.array(codes, dtype=np.int64).reshape(-1, 4).T
    table = np.array(figures, dtype=np.float64).reshape(-1, len(METRICS))  # None becomes NaN
    keys, value_of = _varied_keys([json.loads(text) for text in values.names], varied_of)
    return SweepData(
        name=name,
        planned=planned,
        failures=dict(failures),
        command=command,
        scenarios=tuple(scenarios.names),
        series=_series_names(groups.names),
        performers=tuple(group[-1] for group in groups.names),
        clips=tuple(clips.names),
        keys=keys,
        scenario_of=scenario_of,
        series_of=series_of,
        clip_of=clip_of,
        value_of=value_of,
        metrics=dict(zip(METRICS, table.T, strict=True)),
    )


class _LabelEncoder:
    """Numbers for names, in the order in which they are met."""

    def __init__(self) -> None:
        self.names: list[Any] = []
        self._places: dict[Any, int] = {}

    def code(self, name: Any) -> int:
        if name not in self._places:
            self._places[name] = len(self.names)
            self.names.append(name)
        return self._places[name]


def _series_names(groups: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """Methods, with what tells series of one method apart."""
    names = []
    for method, *telling in groups:
        same = [other for other in groups if other[0] == method]
        apart = [text or "–" for n, text in enumerate(telling, start=1) if len({other[n] for other in same}) > 1]
        names.append(f"{method} ({', '.join(apart)})" if apart else method)
    return tuple(names)


def _varied_keys(found: Sequence[Mapping[str, Any]], varied_of: Ints) -> tuple[tuple[VariedKey, ...], dict[str, Ints]]:
    """Those that take several values, and which value each cell has; `found` are the combinations that there are."""
    keys, value_of = [], {}
    for name in dict.fromkeys(name for varied in found for name in varied):
        values = {_value_label(name, varied[name]): varied[name] for varied in found if name in varied}
        if len(values) < 2:
            continue
        if numeric := all(isinstance(value, int | float) and not isinstance(value, bool) for value in values.values()):
            values = dict(sorted(values.items(), key=lambda item: float(item[1])))
        keys.append(VariedKey(name, tuple(values), tuple(map(float, values.values())) if numeric else ()))
        place = {text: n for n, text in enumerate(values)}
        each = [place[_value_label(name, varied[name])] if name in varied else -1 for varied in found]
        value_of[name] = np.array(each, dtype=np.int64)[varied_of]
    return tuple(keys), value_of


def _value_label(name: str, value: Any) -> str:
    """As tables have it, without the key."""
    return varied_text({name: value}).removeprefix(f"{name}=")
