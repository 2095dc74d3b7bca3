"""False alarms and detections of the regression gate, measured by simulated comparisons with known truth.

A comparison is drawn from stored errors of two equally good sides (see `stored_errors`). Clips are drawn with
replacement, the same for all methods and metrics. For each method and clip, a random swap decides which side is A, so
that neither is better, while methods, metrics and clips keep their dependence. Fifteen lines (five methods, three
metrics) are tested as in a comparison, with its margins. A false alarm is any line called worse. For detections, one
metric of one side B is also multiplied by 1.03; it is detected if that line is called worse.
"""

from collections.abc import Callable

import numpy as np
from scipy import special

from harness.bench.interval_coverage import coverage_rows, earlier_interval
from harness.bench.limits import hold_to_limit
from harness.bench.stored_errors import METRICS, load_null_errors
from harness.compare import CONFIDENCE_LEVEL, SIGNIFICANCE, decide_verdicts, holm, margin_of, mean_interval, sign_flip_p
from harness.core.arrays import Bools, Floats
from harness.core.seeds import generator
from harness.results.findings import BenchmarkStatement

COMPARISONS, CHANGED_COMPARISONS, COVERAGE_COMPARISONS = 1000, 200, 100
RELATIVE_CHANGE = 0.03
Interval = Callable[[Floats, float], tuple[float, float]]
"""The interval of (n,) differences at a level."""
Resampler = Callable[[Floats, int, np.random.Generator], Floats]
"""Draws errors (M, K, n, 2) of a comparison with n clips from those of a population (M, K, C, 2)."""


def compared_lines(errors: Floats, margin: float = 1.0) -> tuple[list[Floats], list[float]]:
    """(n,) differences of each line of errors (M, K, n, 2) with K `METRICS`, and its margin, multiplied by `margin`.

    An increase is worse.
    """
    lines = [(errors[m, k], metric) for m in range(len(errors)) for k, metric in enumerate(METRICS)]
    margins = [margin * margin_of(metric).of(float(line[:, 0].mean())) for line, metric in lines]
    return [line[:, 1] - line[:, 0] for line, _ in lines], margins


def called_worse(errors: Floats, margin: float = 1.0, interval: Interval = mean_interval) -> Bools:
    """(L,) which lines are called worse: as `decide_verdicts`, but without intervals that cannot change this."""
    differences, margins = compared_lines(errors, margin)
    p_holm = holm([sign_flip_p(line) for line in differences])
    lines = zip(differences, margins, p_holm, strict=True)
    return np.array(
        [p <= SIGNIFICANCE and d.mean() > m and interval(d, CONFIDENCE_LEVEL)[0] > 0.0 for d, m, p in lines]
    )


def exchanged(population: Floats, clips: int, rng: np.random.Generator) -> Floats:
    """Draw clips with replacement; exchange the sides of each method and clip at random."""
    picked = population[:, :, rng.integers(0, population.shape[2], clips)]
    swap = rng.random((len(population), 1, clips, 1)) < 0.5
    return np.where(swap, picked[..., ::-1], picked)


def heavy(population: Floats, clips: int, rng: np.random.Generator) -> Floats:
    """As `exchanged`, with differences multiplied by |Student's t, 2 degrees of freedom|: some clips are outliers."""
    errors = exchanged(population, clips, rng)
    stretch = np.abs(rng.standard_t(2, (len(population), 1, clips)))
    return np.stack([errors[..., 0], errors[..., 0] + stretch * (errors[..., 1] - errors[..., 0])], axis=-1)


def centred(population: Floats, clips: int, rng: np.random.Generator) -> Floats:
    """Draw clips without exchange; the mean difference of each line is subtracted, which preserves skew."""
    errors = population.copy()
    errors[..., 1] -= (errors[..., 1] - errors[..., 0]).mean(axis=2, keepdims=True)
    return errors[:, :, rng.integers(0, population.shape[2], clips)]


def count_false_alarms(
    population: Floats, clips: int, studies: int, seed: int, draw: Resampler = exchanged, margin: float = 1.0
) -> int:
    """Number of simulated comparisons in which any line is called worse, although none is."""
    rngs = (generator(seed, "gate", draw.__name__, clips, n) for n in range(studies))
    return sum(bool(called_worse(draw(population, clips, rng), margin).any()) for rng in rngs)


def detect_changes(
    population: Floats,
    clips: int,
    studies: int,
    seed: int,
    change: float = RELATIVE_CHANGE,
    interval: Interval = mean_interval,
) -> Bools:
    """(studies,) whether the changed line is called worse; each line is changed in turn."""
    lines = len(population) * len(METRICS)
    detected = []
    for n in range(studies):
        errors = exchanged(population, clips, generator(seed, "gate", "changed", clips, n))
        method, metric = divmod(n % lines, len(METRICS))
        errors[method, metric, :, 1] *= 1.0 + change
        detected.append(called_worse(errors, interval=interval)[n % lines])
    return np.array(detected)


def share_called_same(population: Floats, clips: int, studies: int, seed: int) -> float:
    """Share of unchanged lines that are called the same; the others are undecided."""
    rngs = (generator(seed, "gate", "exchanged", clips, n) for n in range(studies))
    results = [decide_verdicts(*compared_lines(exchanged(population, clips, rng))) for rng in rngs]
    return float(np.mean([result.verdict == "same" for lines in results for result in lines]))


def interval_coverage(population: Floats, clips: int, studies: int, seed: int) -> float:
    """Share of the 95 % intervals that contain the mean of all stored differences."""
    difference = population[..., 1] - population[..., 0]
    contained = []
    for n in range(studies):
        picked = generator(seed, "gate", "covered", clips, n).integers(0, population.shape[2], clips)
        for line in difference.reshape(-1, population.shape[2]):
            low, high = mean_interval(line[picked])
            contained.append(low <= line.mean() <= high)
    return float(np.mean(contained))


def upper_confidence_rate(count: int, of: int) -> float:
    """Upper 95 % confidence limit of a rate, given `count` events in `of` trials (Clopper and Pearson 1934)."""
    return 1.0 if count == of else float(special.betaincinv(count + 1, of - count, 0.95))


def lower_confidence_rate(count: int, of: int) -> float:
    """Lower 95 % confidence limit of a rate, given `count` events in `of` trials."""
    return 1.0 - upper_confidence_rate(of - count, of)


def bench_regression_gate(seed: int = 1) -> list[BenchmarkStatement]:
    """Rates of false alarms and detections, and the coverage of the intervals."""
    settings, draws = load_null_errors("settings"), load_null_errors("draws")
    rows = [
        *(_false_alarm_row(f"false alarms, {clips} clips", settings, clips, seed) for clips in (24, 12, 8)),
        _false_alarm_row("false alarms, 24 clips, heavy tails", settings, 24, seed, heavy),
        _false_alarm_row("false alarms, 24 clips, sides not exchanged", settings, 24, seed, centred),
        _false_alarm_row("false alarms, 24 clips, margins of 0", settings, 24, seed, margin=0.0),
        _false_alarm_row("false alarms, 24 clips, other noise in B", draws, 24, seed),
        _detection_row("3 % worse detected, 24 clips", settings, 24, seed, gated=True),
        _detection_row("3 % worse detected, 12 clips", settings, 12, seed),
        _detection_row("3 % worse detected, 24 clips, other noise in B", draws, 24, seed),
    ]
    for clips in (24, 12):
        share = 100.0 * share_called_same(settings, clips, COVERAGE_COMPARISONS, seed)
        name, reference = f"equally good sides called the same, {clips} clips", f"{COVERAGE_COMPARISONS} studies"
        rows.append(hold_to_limit(name, share, "%", reference=reference))
    for clips in (24, 12, 8):
        share = 100.0 * interval_coverage(settings, clips, COVERAGE_COMPARISONS, seed)
        reference = f"nominally 95; {COVERAGE_COMPARISONS} studies of {len(METRICS) * len(settings)} lines"
        name = f"intervals that contain the mean of all stored clips, {clips} clips"
        rows.append(hold_to_limit(name, share, "%", reference=reference))
    return [*rows, *coverage_rows(seed)]


def _false_alarm_row(
    name: str, population: Floats, clips: int, seed: int, draw: Resampler = exchanged, margin: float = 1.0
) -> BenchmarkStatement:
    count = count_false_alarms(population, clips, COMPARISONS, seed, draw, margin)
    limit = 100.0 * upper_confidence_rate(count, COMPARISONS)
    reference = f"{count} of {COMPARISONS} studies, at most {limit:.1f} % with 95 % confidence"
    return hold_to_limit(name, 100.0 * count / COMPARISONS, "%", most=5.0, reference=reference)


def _detection_row(name: str, population: Floats, clips: int, seed: int, *, gated: bool = False) -> BenchmarkStatement:
    detected = detect_changes(population, clips, CHANGED_COMPARISONS, seed)
    earlier = detect_changes(population, clips, CHANGED_COMPARISONS, seed, interval=earlier_interval)
    share_by_metric = {metric: float(detected[k :: len(METRICS)].mean()) for k, metric in enumerate(METRICS)}
    by_metric = ", ".join(f"{metric} {share:.0%}" for metric, share in share_by_metric.items())
    count = int(detected.sum())
    limit = 100.0 * lower_confidence_rate(count, CHANGED_COMPARISONS)
    reference = f"{count} of {CHANGED_COMPARISONS} studies, at least {limit:.0f} % with 95 % confidence; {by_metric}; "
    reference += f"earlier version {earlier.mean():.1%}"
    share, least = 100.0 * count / CHANGED_COMPARISONS, 90.0 if gated else None
    return hold_to_limit(name, share, "%", least=least, reference=reference)
