"""The finished cells of a sweep as columns, read from its index, so that statistics of 100,000 cells are fast."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np

from harness.compare import BY_NAME, GATED_METRICS, MIN_UNITS, ClipValues, Sampling, average_units, mean_interval
from harness.core.arrays import Bools, Floats, Ints
from harness.core.estimate import name_with_lag
from harness.core.split import training_note
from harness.results import PRIMARY_METRIC, SECONDARY_METRIC, CellIndex, Manifest, lag_of, varied_text
from harness.results.files import check_folder
from harness.score import DEFINITIONS

METRICS = (PRIMARY_METRIC, SECONDARY_METRIC, "mpjre_deg", "mpjpe_root_mm", "jitter_m_s3", "step_p50_ms", "coverage")
"""Metrics that the page shows; summary.csv has all metrics."""
READ_METRICS = tuple(dict.fromkeys((*METRICS, *GATED_METRICS)))
"""Metrics that are read of each cell."""


@dataclass(frozen=True)
class Statistic:
    """Mean over clips, or over units where it has an interval; a clip is first averaged over other varied values."""

    mean: float | None
    clips: int
    sd: float | None = None
    low: float | None = None
    """Lower end of the 95 % interval; None with fewer than `MIN_UNITS` units, or if it was not requested."""
    high: float | None = None
    """Upper end of the 95 % interval."""
    units: int = 0
    """Number of units that the mean and its interval are over; 0 without an interval."""


@dataclass(frozen=True)
class VariedKey:
    """A varied key; its values rise if they are numbers, else they have the order of the plan."""

    name: str
    labels: tuple[str, ...]
    numbers: tuple[float, ...] = ()
    """The values as numbers; () if any value is not a number."""


@dataclass(frozen=True, eq=False)
class SweepData:
    """N finished cells of a sweep."""

    name: str
    planned: int
    failures: Mapping[str, str]
    """Cell -> message of its refusal, or traceback."""
    command: str
    scenarios: tuple[str, ...]
    series: tuple[str, ...]
    performers: tuple[str, ...]
    """"known", "new" or "" for each series; known and new performers have different clips."""
    lags: tuple[int, ...]
    """Lag of the method of each series [frames]; methods with different lags are never ranked together."""
    clips: tuple[str, ...]
    """Names as "scenario: clip", because clips of the same name may differ between scenarios."""
    sampling: Sampling
    """What is a unit of statistics."""
    keys: tuple[VariedKey, ...]
    scenario_of: Ints
    """(N,) index into `scenarios`."""
    series_of: Ints
    """(N,) index into `series`."""
    clip_of: Ints
    """(N,) index into `clips`."""
    value_of: Mapping[str, Ints]
    """Name of a key -> (N,) index of its value; -1 where the cell's scenario does not vary the key."""
    metrics: Mapping[str, Floats]
    """Metric -> (N,) values; NaN means not measured."""

    def __len__(self) -> int:
        return len(self.scenario_of)

    def select(self, scenario: int | None = None, series: int | None = None, **values: int) -> Bools:
        """(N,) mask of the cells of a scenario, of a series and of values of keys."""
        selected: Bools = np.ones(len(self), dtype=bool)
        if scenario is not None:
            selected &= self.scenario_of == scenario
        if series is not None:
            selected &= self.series_of == series
        for key, value in values.items():
            selected &= self.value_of[key] == value
        return selected

    def by_clip(self, metric: str, selected: Bools) -> Floats:
        """(C,) mean of each clip over the selected cells; NaN for a clip without a measured value."""
        values = self.metrics[metric]
        selected = selected & np.isfinite(values)
        sums = np.bincount(self.clip_of[selected], values[selected], minlength=len(self.clips))
        counts = np.bincount(self.clip_of[selected], minlength=len(self.clips))
        with np.errstate(invalid="ignore"):
            means: Floats = sums / counts
        return means

    def clip_values(self, selected: Bools, metrics: Iterable[str]) -> ClipValues:
        """Metric -> clip -> mean over the selected cells."""
        means = {name: self.by_clip(name, selected) for name in metrics}
        return {
            name: {self.clips[n]: float(values[n]) for n in np.flatnonzero(np.isfinite(values))}
            for name, values in means.items()
        }

    def statistic(self, metric: str, selected: Bools, *, with_interval: bool = False) -> Statistic:
        """Statistic over clips; `with_interval` takes units and their interval, if there are `MIN_UNITS` or more."""
        means = self.by_clip(metric, selected)
        means = means[np.isfinite(means)]
        if not len(means):
            return Statistic(None, 0)
        sd = float(means.std(ddof=1)) if len(means) > 1 else None
        mean, low, high, units = float(means.mean()), None, None, 0
        if with_interval:
            by_unit = average_units(self.clip_values(selected, (metric,))[metric], self.sampling)
            if len(by_unit) >= MIN_UNITS:
                of_units = np.array(list(by_unit.values()))
                mean, (low, high), units = float(of_units.mean()), mean_interval(of_units), len(of_units)
        return Statistic(mean, len(means), sd, low, high, units)


def unit_of(metric: str) -> str:
    """Unit of a metric."""
    return DEFINITIONS[metric].unit


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
            lags=map(lag_of, index.optional()),
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

    `lags` has the number of later frames that the method of each cell uses, by default 0. `sampling` and
    `training_data` are those of the manifest.
    """
    scenarios, clips, groups, values = _LabelEncoder(), _LabelEncoder(), _LabelEncoder(), _LabelEncoder()
    codes: list[tuple[int, int, int, int]] = []
    figures: list[Sequence[float | None]] = []
    lag_of_group: dict[int, int] = {}
    for (scenario, clip, method, *others), frames in zip(cells, repeat(0) if lags is None else lags, strict=False):
        group = (name_with_lag(method, frames), *others[: len(_GROUP_COLUMNS)])
        lag_of_group.setdefault(groups.code(group), frames)
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
