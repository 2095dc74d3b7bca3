"""Planted errors: every condition of the benchmark with few clips, each at a known number of degrees."""

from collections.abc import Mapping, Sequence

from harness.bench.accuracy.clip_errors import CELL_METRICS, SILENT_ANGLE, ClipErrors, ErrorsByCondition, StoredErrors
from harness.bench.accuracy.conditions import CONDITIONS, SEEDS, TABLE_SCENARIOS

COMMIT = "40f3d61" + "0" * 33


def clip_errors(degrees: Sequence[float], performer: str = "known", *, silent: bool = False) -> ClipErrors:
    """Errors of one clip, one value for each seed; other metrics are multiples of the joint angle error."""
    by_metric: dict[str, tuple[float | None, ...]] = {
        metric: tuple((n + 1) * value for value in degrees) for n, metric in enumerate(CELL_METRICS)
    }
    if silent:
        by_metric[SILENT_ANGLE] = tuple(2.0 * value for value in degrees)
    return ClipErrors("boxing", performer, by_metric)


def errors(
    degrees: float, *, clips: int = 3, changed: Mapping[tuple[str, str], float] | None = None
) -> ErrorsByCondition:
    """Errors of every condition: `clips` clips of known and of new performers, seed k off by 0.1 (k - mean).

    `changed` maps (condition, clip) to other degrees.
    """
    found: dict[str, dict[str, ClipErrors]] = {}
    for condition in CONDITIONS:
        seeds = condition.seeds(SEEDS)
        offsets = [0.1 * (k - (len(seeds) - 1) / 2) for k in range(len(seeds))]
        for performer in ("known", "new") if condition.scenario in TABLE_SCENARIOS else ("known",):
            for n in range(clips):
                clip = f"{condition.scenario}_{performer}_{n}"
                value = (changed or {}).get((str(condition), clip), degrees + 0.01 * n)
                planted = clip_errors([value + o for o in offsets], performer, silent=bool(condition.silent))
                found.setdefault(str(condition), {})[clip] = planted
    return found


def stored(conditions: ErrorsByCondition) -> StoredErrors:
    """Stored errors of these conditions."""
    return StoredErrors("dynamic_map", COMMIT, SEEDS, conditions)
