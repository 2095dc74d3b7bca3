"""What the page of a sweep needs: every finished cell in columns, so that 100,000 of them are summed up in a moment."""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.score.cell import varied_text
from harness.score.index import CellIndex
from harness.score.metrics import DEFINITIONS
from harness.score.paired import FEWEST_CLIPS, interval

HEADLINE, SECOND = "joint_angle_mean_deg", "mpjpe_mm"
METRICS = (HEADLINE, SECOND, "mpjre_deg", "mpjpe_root_mm", "jitter_m_s3", "step_p50_ms", "coverage")
"""What the page has of each cell; the table has the rest."""
_TELLING = ("inputs", "protocol", "performer")
"""Never pooled, the performer last: a method has a series for each combination of them that it has."""
_COLUMNS = ("scenario", "clip", "method", *_TELLING, "varied", *METRICS)


@dataclass(frozen=True)
class Statistic:
    """A mean over clips; each clip is first averaged over whatever else was varied."""

    mean: float | None
    clips: int
    sd: float | None = None
    low: float | None = None
    """End of the 95 % interval; None with fewer than `FEWEST_CLIPS`, or where it was not asked for."""
    high: float | None = None


@dataclass(frozen=True)
class Key:
    """What was varied: its values in rising order if they are numbers, else as they came."""

    name: str
    texts: tuple[str, ...]
    numbers: tuple[float, ...] = ()
    """The same as numbers; () where any is none."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """N finished cells."""

    name: str
    planned: int
    failures: Mapping[str, str]
    """Cell -> refusal or traceback."""
    command: str
    scenarios: tuple[str, ...]
    series: tuple[str, ...]
    performers: tuple[str, ...]
    """"known", "new" or "" of each series: these have other clips."""
    clips: tuple[str, ...]
    """As "scenario: clip", for equal names may be other motion."""
    keys: tuple[Key, ...]
    scenario_of: Ints
    """(N,) index into `scenarios`."""
    series_of: Ints
    clip_of: Ints
    value_of: Mapping[str, Ints]
    """Name of the key -> (N,) which of its values; -1 where the cell's scenario does not vary it."""
    metrics: Mapping[str, Floats]
    """(N,) each; NaN is "not measured"."""

    def __len__(self) -> int:
        return len(self.scenario_of)

    def where(self, scenario: int | None = None, series: int | None = None, **values: int) -> Bools:
        """(N,) the cells of a scenario, a series and of values of keys."""
        chosen: Bools = np.ones(len(self), dtype=bool)
        if scenario is not None:
            chosen &= self.scenario_of == scenario
        if series is not None:
            chosen &= self.series_of == series
        for key, value in values.items():
            chosen &= self.value_of[key] == value
        return chosen

    def by_clip(self, metric: str, chosen: Bools) -> Floats:
        """(C,) the mean of each clip; NaN for one of which nothing was chosen or measured."""
        values = self.metrics[metric]
        chosen = chosen & np.isfinite(values)
        sums = np.bincount(self.clip_of[chosen], values[chosen], minlength=len(self.clips))
        counts = np.bincount(self.clip_of[chosen], minlength=len(self.clips))
        with np.errstate(invalid="ignore"):
            means: Floats = sums / counts
        return means

    def statistic(self, metric: str, chosen: Bools, *, ends: bool = False) -> Statistic:
        """Over clips; with its interval where there are clips enough and `ends` asks for it."""
        means = self.by_clip(metric, chosen)
        means = means[np.isfinite(means)]
        if not len(means):
            return Statistic(None, 0)
        sd = float(means.std(ddof=1)) if len(means) > 1 else None
        low, high = interval(means) if ends and len(means) >= FEWEST_CLIPS else (None, None)
        return Statistic(float(means.mean()), len(means), sd, low, high)


def read_sweep(out: Path) -> Sweep:
    """Everything that is finished in the folder of a sweep, also while it runs; BadFile when it is none."""
    with CellIndex(out, read_only=True) as index:
        counts, failures, facts = index.counts(), index.failures(), index.facts()
        return gathered(
            index.columns(*_COLUMNS),
            name=str(facts.get("name", out.name)),
            planned=counts.planned,
            failures=failures,
            command=str(facts.get("command", "")),
        )


def gathered(
    cells: Iterable[Sequence[Any]], *, name: str, planned: int, failures: Mapping[str, str], command: str = ""
) -> Sweep:
    """From the index's columns, a cell at a time."""
    scenarios, clips, groups, values = _Codes(), _Codes(), _Codes(), _Codes()
    codes: list[tuple[int, int, int, int]] = []
    figures: list[Sequence[float | None]] = []
    for scenario, clip, method, *telling in cells:
        group = (method, *telling[: len(_TELLING)])
        varied, *metrics = telling[len(_TELLING) :]
        clip_code = clips.of(f"{scenario}: {clip}")
        codes.append((scenarios.of(scenario), clip_code, groups.of(group), values.of(varied)))
        figures.append(metrics)
    scenario_of, clip_of, series_of, varied_of = np.array(codes, dtype=np.int64).reshape(-1, 4).T
    table = np.array(figures, dtype=np.float64).reshape(-1, len(METRICS))  # None becomes NaN
    keys, value_of = _keys([json.loads(text) for text in values.names], varied_of)
    return Sweep(
        name=name,
        planned=planned,
        failures=dict(failures),
        command=command,
        scenarios=tuple(scenarios.names),
        series=_named(groups.names),
        performers=tuple(group[-1] for group in groups.names),
        clips=tuple(clips.names),
        keys=keys,
        scenario_of=scenario_of,
        series_of=series_of,
        clip_of=clip_of,
        value_of=value_of,
        metrics=dict(zip(METRICS, table.T, strict=True)),
    )


def unit_of(metric: str) -> str:
    return DEFINITIONS[metric].unit


class _Codes:
    """Numbers for names, in the order in which they are met."""

    def __init__(self) -> None:
        self.names: list[Any] = []
        self._places: dict[Any, int] = {}

    def of(self, name: Any) -> int:
        if name not in self._places:
            self._places[name] = len(self.names)
            self.names.append(name)
        return self._places[name]


def _named(groups: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """Methods, with what tells series of one method apart."""
    names = []
    for method, *telling in groups:
        same = [other for other in groups if other[0] == method]
        apart = [text or "–" for n, text in enumerate(telling, start=1) if len({other[n] for other in same}) > 1]
        names.append(f"{method} ({', '.join(apart)})" if apart else method)
    return tuple(names)


def _keys(found: Sequence[Mapping[str, Any]], varied_of: Ints) -> tuple[tuple[Key, ...], dict[str, Ints]]:
    """Those that take several values, and which value each cell has; `found` are the combinations that there are."""
    keys, value_of = [], {}
    for name in dict.fromkeys(name for varied in found for name in varied):
        values = {_text(name, varied[name]): varied[name] for varied in found if name in varied}
        if len(values) < 2:
            continue
        if numeric := all(isinstance(value, int | float) and not isinstance(value, bool) for value in values.values()):
            values = dict(sorted(values.items(), key=lambda item: float(item[1])))
        keys.append(Key(name, tuple(values), tuple(map(float, values.values())) if numeric else ()))
        place = {text: n for n, text in enumerate(values)}
        each = [place[_text(name, varied[name])] if name in varied else -1 for varied in found]
        value_of[name] = np.array(each, dtype=np.int64)[varied_of]
    return tuple(keys), value_of


def _text(name: str, value: Any) -> str:
    """As tables have it, without the key."""
    return varied_text({name: value}).removeprefix(f"{name}=")
