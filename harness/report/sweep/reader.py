"""Reads the finished cells of a sweep from its index, with the columns that the page needs."""

import json
from collections.abc import Iterable, Mapping, Sequence
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np

from harness.compare.units import BY_NAME, Sampling
from harness.core.arrays import Ints
from harness.core.estimate import name_with_lag
from harness.core.split import training_note
from harness.report.sweep.data import READ_METRICS, SweepData, VariedKey
from harness.results.cell import varied_text
from harness.results.index import CellIndex
from harness.results.integrity import check_folder
from harness.results.manifest import Manifest

_GROUP_COLUMNS = ("inputs", "split", "performer")
"""Columns that are never pooled: each combination of them is a series of its own. The performer must be last."""
_COLUMNS = ("scenario", "clip", "method", *_GROUP_COLUMNS, "varied", *READ_METRICS)


def read_sweep(out: Path) -> SweepData:
    """The finished cells of the sweep in `out`, also while it runs.

    BadFile if `out` holds no sweep, or a damaged or edited one.
    """
    check_folder(out)
    manifest = Manifest.read(out / "manifest.json")
    with CellIndex(out, read_only=True) as index:
        counts, failures, facts = index.counts(), index.failures(), index.facts()
        return collect_cells(
            index.columns(*_COLUMNS),
            lags=(values["lag"] for values in index.optional()),
            name=str(facts.get("name", out.name)),
            planned=counts.planned,
            failures=failures,
            command=str(facts.get("command", "")),
            sampling=Sampling(manifest.performers, manifest.unit),
            training_data=manifest.training_data,
        )


def collect_cells(
    cells: Iterable[Sequence[Any]],
    *,
    name: str,
    planned: int,
    failures: Mapping[str, str],
    command: str = "",
    lags: Iterable[int] | None = None,
    sampling: Sampling = BY_NAME,
    training_data: Mapping[str, str] | None = None,
) -> SweepData:
    """The data of a sweep from its cells, each a row of the index's columns.

    `lags` has the lag of the method of each cell [frames], by default 0. `sampling` and `training_data` are
    those of the manifest.
    """
    scenarios, clips, groups, values = _LabelEncoder(), _LabelEncoder(), _LabelEncoder(), _LabelEncoder()
    codes: list[tuple[int, int, int, int]] = []
    figures: list[Sequence[float | None]] = []
    lag_of_group: dict[int, int] = {}
    for (scenario, clip, method, *others), lag in zip(cells, repeat(0) if lags is None else lags, strict=False):
        group = (name_with_lag(method, lag), *others[: len(_GROUP_COLUMNS)])
        lag_of_group.setdefault(groups.code(group), lag)
        varied, *metrics = others[len(_GROUP_COLUMNS) :]
        clip_code = clips.code(f"{scenario}: {clip}")
        codes.append((scenarios.code(scenario), clip_code, groups.code(group), values.code(varied)))
        figures.append(metrics)
    scenario_of, clip_of, series_of, varied_of = np.array(codes, dtype=np.int64).reshape(-1, 4).T
    table = np.array(figures, dtype=np.float64).reshape(-1, len(READ_METRICS))  # None becomes NaN
    keys, value_of = _varied_keys([json.loads(text) for text in values.names], varied_of)
    return SweepData(
        name=name,
        planned=planned,
        failures=dict(failures),
        command=command,
        scenarios=tuple(scenarios.names),
        series=_series_names(groups.names, training_data or {}),
        performers=tuple(group[-1] for group in groups.names),
        lags=tuple(lag_of_group[code] for code in range(len(groups.names))),
        clips=tuple(clips.names),
        sampling=sampling,
        keys=keys,
        scenario_of=scenario_of,
        series_of=series_of,
        clip_of=clip_of,
        value_of=value_of,
        metrics=dict(zip(READ_METRICS, table.T, strict=True)),
    )


class _LabelEncoder:
    """Consecutive integer codes for names, in order of first occurrence."""

    def __init__(self) -> None:
        self.names: list[Any] = []
        self._codes: dict[Any, int] = {}

    def code(self, name: Any) -> int:
        if name not in self._codes:
            self._codes[name] = len(self.names)
            self.names.append(name)
        return self._codes[name]


def _series_names(groups: Sequence[tuple[str, ...]], training_data: Mapping[str, str]) -> tuple[str, ...]:
    """Names of the methods, qualified by what distinguishes series of one method, and by notes on training data."""
    names = []
    for method, *group in groups:
        same = [other for other in groups if other[0] == method]
        words = [text or "–" for n, text in enumerate(group, start=1) if len({other[n] for other in same}) > 1]
        words += filter(None, [training_note(training_data.get(method))])
        names.append(f"{method} ({', '.join(words)})" if words else method)
    return tuple(names)


def _varied_keys(
    combinations: Sequence[Mapping[str, Any]], varied_of: Ints
) -> tuple[tuple[VariedKey, ...], dict[str, Ints]]:
    """Keys with several values, and the value of each key in each cell; `varied_of` indexes `combinations`."""
    keys, value_of = [], {}
    for name in dict.fromkeys(name for varied in combinations for name in varied):
        values = {_value_label(name, varied[name]): varied[name] for varied in combinations if name in varied}
        if len(values) < 2:
            continue
        if numeric := all(isinstance(value, int | float) and not isinstance(value, bool) for value in values.values()):
            values = dict(sorted(values.items(), key=lambda item: float(item[1])))
        keys.append(VariedKey(name, tuple(values), tuple(map(float, values.values())) if numeric else ()))
        code = {text: n for n, text in enumerate(values)}
        codes = [code[_value_label(name, varied[name])] if name in varied else -1 for varied in combinations]
        value_of[name] = np.array(codes, dtype=np.int64)[varied_of]
    return tuple(keys), value_of


def _value_label(name: str, value: Any) -> str:
    """The value as text, as in tables but without the key."""
    return varied_text({name: value}).removeprefix(f"{name}=")
