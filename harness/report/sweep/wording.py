"""A sweep in words: what it found, how far it came, what failed and how often."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.compare.paired_statistics import MIN_CLIPS, bootstrap_interval
from harness.core.arrays import Floats
from harness.report.comparison.wording import format_percent, list_first
from harness.report.run.tables import format_number
from harness.report.sweep.data import PRIMARY_METRIC, SweepData, VariedKey, unit_of


@dataclass(frozen=True)
class FailureGroup:
    """What several cells failed of."""

    message: str
    """The last one of the traceback."""
    cells: tuple[str, ...]
    traceback: str
    """The first cell's, whole."""


def sentence(sweep: SweepData) -> str:
    """What a reader should know first."""
    return f"{progress_sentence(sweep)} {_best(sweep)}".strip()


def progress_sentence(sweep: SweepData) -> str:
    """How many cells are finished, failed and still to come."""
    to_come = sweep.planned - len(sweep) - len(sweep.failures)
    said = [f"{len(sweep):,} of {sweep.planned:,} cells finished"]
    said += [f"{len(sweep.failures):,} failed"] if sweep.failures else []
    said += [f"{to_come:,} still to come"] if to_come > 0 else []
    return f"{', '.join(said)}."


def _best(sweep: SweepData) -> str:
    """Of known and of new performers, which have other clips."""
    found = {name: sweep.by_clip(PRIMARY_METRIC, sweep.select(series=n)) for n, name in enumerate(sweep.series)}
    found = {name: means for name, means in found.items() if np.isfinite(means).any()}
    kinds = {name: kind for name, kind in zip(sweep.series, sweep.performers, strict=True) if name in found}
    if not found:
        return "Nothing was measured." if len(sweep) else ""
    return " ".join(
        _best_of({name: means for name, means in found.items() if kinds[name] == kind})
        for kind in dict.fromkeys(kinds.values())
    )


def _best_of(found: Mapping[str, Floats]) -> str:
    """The series with the least error on the clips that all were measured on, over everything that was varied."""
    shared = np.all([np.isfinite(means) for means in found.values()], axis=0)
    clips = int(shared.sum())
    over = f"over {clips:,} clip{'s'[: clips != 1]}"
    if not clips:
        return f"{list_first(list(found))} share no measured clip: none is best."
    errors = {name: float(means[shared].mean()) for name, means in found.items()}
    first, *others = sorted(errors, key=lambda name: errors[name])
    start = f"{first}{' errs least' if others else ''}: {_format_error(errors[first])} mean joint-angle error {over}"
    if not others:
        return f"{start}."
    apart = _describe_difference(found[others[0]][shared] - found[first][shared])
    return f"{start}; next {others[0]} with {_format_error(errors[others[0]])}, {apart}."


def _describe_difference(difference: Floats) -> str:
    """Whether clips tell the second from the first."""
    if len(difference) < MIN_CLIPS:
        return "which so few clips cannot tell apart"
    low, high = bootstrap_interval(difference)
    if low <= 0.0 <= high:
        return "which these clips cannot tell apart"
    return f"worse by {format_number(low, unit_of(PRIMARY_METRIC))} to {_format_error(high)} (95 %)"


def describe_effect(sweep: SweepData, key: VariedKey) -> str:
    """From which value to which the error goes, over the series and clips that have all values."""
    means = np.array([_per_series(sweep, key, value) for value in range(len(key.labels))])
    shared = np.isfinite(means).all(axis=0)
    if not shared.any():
        return "no clip was measured with all values"
    errors = means[:, shared].mean(axis=1)
    least, most = int(np.argmin(errors)), int(np.argmax(errors))
    rise = format_percent(100.0 * (errors[most] / errors[least] - 1.0)) if errors[least] else "–"
    return f"{_format_error(errors[least])} at {key.labels[least]}, {_format_error(errors[most])} at {key.labels[most]} ({rise})"


def group_failures(sweep: SweepData) -> list[FailureGroup]:
    """Failures that end alike are one, the most frequent first."""
    found: dict[str, list[str]] = {}
    for cell, text in sweep.failures.items():
        found.setdefault(_last_line(text), []).append(cell)
    in_order = sorted(found.items(), key=lambda item: -len(item[1]))
    return [FailureGroup(line, tuple(cells), sweep.failures[cells[0]]) for line, cells in in_order]


def list_values(key: VariedKey, most: int = 8) -> str:
    return list_first(key.labels, most)


def _per_series(sweep: SweepData, key: VariedKey, value: int) -> Floats:
    """(series * clips,) errors at one value."""
    parts = [
        sweep.by_clip(PRIMARY_METRIC, sweep.select(series=n, **{key.name: value})) for n in range(len(sweep.series))
    ]
    return np.concatenate(parts)


def _format_error(value: float) -> str:
    return f"{format_number(value, unit_of(PRIMARY_METRIC))} {unit_of(PRIMARY_METRIC)}"


def _last_line(text: str) -> str:
    return (text.strip().splitlines() or ["no message"])[-1]
