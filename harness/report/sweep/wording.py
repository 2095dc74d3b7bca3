"""A sweep in words: its progress, the best method, the effect of each key, and groups of failures."""

from collections.abc import Mapping

import numpy as np

from harness.compare import GATED_METRICS, ClipValues, Sampling, count_clips, rank_methods, split_by_lag
from harness.core.arrays import Floats
from harness.core.number_format import format_change_percent, format_number
from harness.report.kit.ranking import LAG_NOTE, describe_ranking, name_lag
from harness.report.kit.text import last_line, list_first
from harness.report.sweep.data import SweepData, VariedKey, unit_of
from harness.results import PRIMARY_METRIC


def sweep_sentence(sweep: SweepData) -> str:
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
    """The sentences on the best series, separately for known and new performers and for each number of later frames."""
    groups: dict[str, dict[str, ClipValues]] = {}
    for n, (name, performer) in enumerate(zip(sweep.series, sweep.performers, strict=True)):
        values = sweep.clip_values(sweep.select(series=n), GATED_METRICS)
        if values[PRIMARY_METRIC]:
            groups.setdefault(performer, {})[name] = values
    if not groups:
        return "Nothing was measured." if len(sweep) else ""
    lags = dict(zip(sweep.series, sweep.lags, strict=True))
    parts = [part for group in groups.values() for part in split_by_lag(group, lags).items()]
    sentences = [_best_of(values, frames, sweep.sampling) for frames, values in sorted(parts, key=lambda part: part[0])]
    return " ".join([*sentences, *([LAG_NOTE] if len({frames for frames, _ in parts}) > 1 else [])])


def _best_of(values: Mapping[str, ClipValues], frames: int, sampling: Sampling) -> str:
    ranking = rank_methods(values, PRIMARY_METRIC, sampling)
    if ranking is None:
        return f"{list_first(list(values))} share no measured clip, so they are not ranked."
    where = count_clips(ranking.clips, sampling) + (f", with {name_lag(frames)}" if frames else "")
    return describe_ranking(ranking, where, _format_error)


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


def group_failures(sweep: SweepData) -> dict[str, list[str]]:
    """Last line of the traceback -> cells that failed with it, the most frequent first."""
    cells_of: dict[str, list[str]] = {}
    for cell, text in sweep.failures.items():
        cells_of.setdefault(last_line(text), []).append(cell)
    return dict(sorted(cells_of.items(), key=lambda item: -len(item[1])))


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
