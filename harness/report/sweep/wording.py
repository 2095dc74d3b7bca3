"""A sweep in words: its progress, the best method, the effect of each key, and groups of failures."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.compare.paired_statistics import MIN_CLIPS, bootstrap_interval
from harness.core.arrays import Floats
from harness.core.number_format import count_noun, format_change_percent, format_number
from harness.report.kit.text import last_line, list_first
from harness.report.sweep.data import SweepData, VariedKey, unit_of
from harness.results.reported_metrics import PRIMARY_METRIC


@dataclass(frozen=True)
class FailureGroup:
    """Cells that failed with the same message."""

    message: str
    """Last line of the traceback."""
    cells: tuple[str, ...]
    traceback: str
    """Full traceback of the first cell."""


def sentence(sweep: SweepData) -> str:
    """Progress and best method, in a few sentences."""
    return f"{progress_sentence(sweep)} {_best(sweep)}".strip()


def progress_sentence(sweep: SweepData) -> str:
    """Number of cells that are finished, failed and not yet run."""
    remaining = sweep.planned - len(sweep) - len(sweep.failures)
    parts = [f"{len(sweep):,} of {sweep.planned:,} cells finished"]
    parts += [f"{len(sweep.failures):,} failed"] if sweep.failures else []
    parts += [f"{remaining:,} still to run"] if remaining > 0 else []
    return f"{', '.join(parts)}."


def _best(sweep: SweepData) -> str:
    """The sentences on the best series, separately for known and new performers, which have different clips."""
    measured = {name: sweep.by_clip(PRIMARY_METRIC, sweep.select(series=n)) for n, name in enumerate(sweep.series)}
    measured = {name: means for name, means in measured.items() if np.isfinite(means).any()}
    if not measured:
        return "Nothing was measured." if len(sweep) else ""
    groups: dict[str, dict[str, Floats]] = {}
    for name, performer in zip(sweep.series, sweep.performers, strict=True):
        if name in measured:
            groups.setdefault(performer, {})[name] = measured[name]
    return " ".join(map(_best_of, groups.values()))


def _best_of(by_clip: Mapping[str, Floats]) -> str:
    """The series with the lowest mean on the clips that all were measured on; `by_clip` has (C,) errors of each."""
    shared = np.all([np.isfinite(means) for means in by_clip.values()], axis=0)
    clips = int(shared.sum())
    if not clips:
        return f"{list_first(list(by_clip))} share no measured clip, so they are not ranked."
    errors = {name: float(means[shared].mean()) for name, means in by_clip.items()}
    best, *others = sorted(errors, key=lambda name: errors[name])
    start = f"{best}{' has the lowest error' if others else ''}: {_format_error(errors[best])} mean joint-angle error"
    start += f" over {count_noun(clips, 'clip')}"
    if not others:
        return f"{start}."
    second = others[0]
    verdict = _describe_difference(by_clip[second][shared] - by_clip[best][shared])
    return f"{start}. The next is {second} with {_format_error(errors[second])}; {verdict}."


def _describe_difference(difference: Floats) -> str:
    """Whether the difference (C,) between two series is established over clips."""
    if len(difference) < MIN_CLIPS:
        return "there are too few clips to establish a difference"
    low, high = bootstrap_interval(difference)
    if low <= 0.0 <= high:
        return "the 95 % interval of the difference contains zero"
    return f"it is worse by {format_number(low, unit_of(PRIMARY_METRIC))} to {_format_error(high)} (95 % interval)"


def describe_effect(sweep: SweepData, key: VariedKey) -> str:
    """Lowest and highest error over the values of a key, from series and clips that have all values."""
    means = np.array([_per_series(sweep, key, value) for value in range(len(key.labels))])
    shared = np.isfinite(means).all(axis=0)
    if not shared.any():
        return "no clip was measured with all values"
    errors = means[:, shared].mean(axis=1)
    low, high = int(np.argmin(errors)), int(np.argmax(errors))
    rise = format_change_percent(100.0 * (errors[high] / errors[low] - 1.0)) if errors[low] else "–"
    lowest, highest = (f"{_format_error(errors[n])} at {key.labels[n]}" for n in (low, high))
    return f"{lowest}, {highest} ({rise})"


def group_failures(sweep: SweepData) -> list[FailureGroup]:
    """Failures grouped by their last line, the most frequent first."""
    cells_of: dict[str, list[str]] = {}
    for cell, text in sweep.failures.items():
        cells_of.setdefault(last_line(text), []).append(cell)
    in_order = sorted(cells_of.items(), key=lambda item: -len(item[1]))
    return [FailureGroup(line, tuple(cells), sweep.failures[cells[0]]) for line, cells in in_order]


def list_values(key: VariedKey, most: int = 8) -> str:
    """The first values of a key, and the number of the others."""
    return list_first(key.labels, most)


def _per_series(sweep: SweepData, key: VariedKey, value: int) -> Floats:
    """(series * clips,) errors at one value of the key."""
    parts = [
        sweep.by_clip(PRIMARY_METRIC, sweep.select(series=n, **{key.name: value})) for n in range(len(sweep.series))
    ]
    return np.concatenate(parts)


def _format_error(value: float) -> str:
    return f"{format_number(value, unit_of(PRIMARY_METRIC))} {unit_of(PRIMARY_METRIC)}"
