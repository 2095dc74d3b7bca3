"""The effect of each varied key of a sweep, and whether the effect of one key depends on another.

Only blocks count in which every value was measured: the same clip, method, scenario and other values. Blocks are
averaged over the clips of a unit, and units are compared pairwise, by the rules of `harness compare`. Holm's correction
covers all other values of a key, and all contrasts of all pairs of keys.
"""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.compare import Verdict, average_units, decide_verdicts, margin_of
from harness.core.arrays import Bools, Floats
from harness.core.number_format import Interval
from harness.report.sweep.data import SweepData, VariedKey, unit_of
from harness.results import PRIMARY_METRIC


@dataclass(frozen=True)
class Contrast:
    """A mean paired difference and what can be told about it."""

    difference: Interval
    verdict: Verdict
    why: str
    p: float | None
    """Corrected by Holm's method; None with too few units."""

    @property
    def is_told(self) -> bool:
        """Whether it is significant and larger than the margin."""
        return self.verdict in ("better", "worse")


@dataclass(frozen=True, eq=False)
class KeyEffect:
    """The errors at each value of a key, and the value of the lowest error against each other one."""

    key: VariedKey
    units: tuple[str, ...]
    errors: Floats
    """(U, K) error of each unit at each value."""
    contrasts: Mapping[int, Contrast]
    """Index of another value -> its error minus the lowest one; *better* where the lowest is told to be lower."""

    @property
    def lowest(self) -> int:
        """Index of the value with the lowest mean error."""
        return int(np.argmin(self.errors.mean(axis=0)))


@dataclass(frozen=True, eq=False)
class Interaction:
    """How the effect of a key changes with the value of another."""

    key: VariedKey
    """The key whose effect is looked at."""
    by: VariedKey
    """The key that it may depend on."""
    units: tuple[str, ...]
    errors: Floats
    """(U, K, L) error of each unit at each value of `key` and of `by`."""
    contrasts: Mapping[tuple[int, int], Contrast]
    """(value of `key`, value of `by`) -> difference of differences: how much more that value instead of the first one
    adds to the error there than at the first value of `by`."""

    @property
    def largest(self) -> tuple[int, int]:
        """The contrast to report: the largest one that can be told, else the largest one."""
        return max(
            self.contrasts, key=lambda at: (self.contrasts[at].is_told, abs(self.contrasts[at].difference.value))
        )

    def effects(self, value: int) -> list[Interval]:
        """What a value of `key` instead of its first one adds to the error, at each value of `by`."""
        lines = (self.errors[:, value] - self.errors[:, 0]).T
        return [contrast.difference for contrast in _decide(list(lines), self.errors)]


def key_effects(sweep: SweepData, performers: str) -> list[KeyEffect]:
    """The effect of each key on clips of one kind of performers; keys without complete blocks are left out."""
    effects = []
    for key in sweep.keys:
        units, errors = _errors_by_unit(sweep, (key,), performers)
        if not units:
            continue
        lowest = int(np.argmin(errors.mean(axis=0)))
        others = [n for n in range(len(key.labels)) if n != lowest]
        decided = _decide([errors[:, n] - errors[:, lowest] for n in others], errors)
        effects.append(KeyEffect(key, units, errors, dict(zip(others, decided, strict=True))))
    return effects


def key_interactions(sweep: SweepData, performers: str) -> list[Interaction]:
    """The interaction of each pair of keys that vary together, on clips of one kind of performers."""
    pairs = []
    for pair in itertools.combinations(sweep.keys, 2):
        by, key = sorted(pair, key=lambda k: (not k.numbers, -len(k.numbers)))
        units, errors = _errors_by_unit(sweep, (key, by), performers)
        if units:
            pairs.append((key, by, units, errors))
    cells = [[(k, n) for k in range(1, errors.shape[1]) for n in range(1, errors.shape[2])] for *_, errors in pairs]
    lines, margins = [], []
    for (*_, errors), at in zip(pairs, cells, strict=True):
        effect = errors - errors[:, :1]
        lines += [effect[:, k, n] - effect[:, k, 0] for k, n in at]
        margins += [_margin(errors)] * len(at)
    decided = iter(_contrasts(lines, margins))
    return [Interaction(*pair, {where: next(decided) for where in at}) for pair, at in zip(pairs, cells, strict=True)]


def _decide(lines: Sequence[Floats], errors: Floats) -> list[Contrast]:
    return _contrasts(lines, [_margin(errors)] * len(lines))


def _margin(errors: Floats) -> float:
    return margin_of(PRIMARY_METRIC).of(float(errors.mean()))


def _contrasts(lines: Sequence[Floats], margins: Sequence[float]) -> list[Contrast]:
    unit = unit_of(PRIMARY_METRIC)
    return [
        Contrast(Interval.of(float(line.mean()), r.low, r.high, unit, signed=True), r.verdict, r.why, r.p_holm)
        for line, r in zip(lines, decide_verdicts(lines, margins), strict=True)
    ]


def _errors_by_unit(sweep: SweepData, keys: Sequence[VariedKey], performers: str) -> tuple[tuple[str, ...], Floats]:
    """The units, and (U, values of each key...) errors over complete blocks; () without a complete block."""
    values = sweep.metrics[PRIMARY_METRIC]
    of_kind = np.array([kind == performers for kind in sweep.performers], dtype=bool)
    selected: Bools = np.isfinite(values) & of_kind[sweep.series_of] if len(sweep) else np.zeros(0, dtype=bool)
    for key in keys:
        selected &= sweep.value_of[key.name] >= 0
    shape = tuple(len(key.labels) for key in keys)
    cell = np.zeros(int(selected.sum()), dtype=np.int64)
    for key in keys:
        cell = cell * len(key.labels) + sweep.value_of[key.name][selected]
    others = [sweep.value_of[key.name][selected] for key in sweep.keys if key not in keys]
    columns = [sweep.clip_of[selected], sweep.series_of[selected], *others]
    blocks, block = np.unique(np.stack(columns, axis=1), axis=0, return_inverse=True)
    at = block.reshape(-1) * int(np.prod(shape)) + cell
    size = len(blocks) * int(np.prod(shape))
    with np.errstate(invalid="ignore"):
        means = np.bincount(at, values[selected], size) / np.bincount(at, minlength=size)
    means = means.reshape(len(blocks), -1)
    complete = np.isfinite(means).all(axis=1)
    if not complete.any():
        return (), np.zeros((0, *shape))
    clips = [sweep.clips[n] for n in blocks[complete, 0]]
    by_cell = [_average(clips, column, sweep) for column in means[complete].T]
    units = tuple(by_cell[0])
    return units, np.array([list(of_unit.values()) for of_unit in by_cell]).T.reshape(len(units), *shape)


def _average(clips: Sequence[str], values: Floats, sweep: SweepData) -> dict[str, float]:
    """Unit -> mean over its clips of the mean over their blocks."""
    of_clip: dict[str, list[float]] = {}
    for clip, value in zip(clips, values, strict=True):
        of_clip.setdefault(clip, []).append(float(value))
    return average_units({clip: float(np.mean(of)) for clip, of in of_clip.items()}, sweep.sampling)
