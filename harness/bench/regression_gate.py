"""How often the regression gate cries wolf, and how often it sees one: simulated studies of known truth.

A study is drawn from stored errors of two equally good sides (see `gate_errors`): clips with replacement, the same ones
for all methods and metrics, and for each method and clip a coin says which side is A, so that neither is better, while
methods, metrics and clips keep what they share. Fifteen lines, of five methods by three metrics, are judged as a
comparison would, with its margins. An alarm is any line called worse. A change multiplies one metric of one side B by
1.03 on top of that; it is found if that very line is called worse.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import special

from harness.bench.null_errors import METRICS, ErrorPopulation, load_population
from harness.bench.rows import BenchmarkRow
from harness.compare.margins import margin_of
from harness.compare.paired_statistics import bootstrap_interval
from harness.compare.significance import SIGNIFICANCE, decide_verdicts, holm, sign_flip_p
from harness.core.arrays import Bools, Floats
from harness.core.seeds import generator

COMPARISONS, CHANGED_COMPARISONS, COVERAGE_COMPARISONS = 1000, 200, 100
RELATIVE_CHANGE = 0.03
Resampler = Callable[[ErrorPopulation, int, np.random.Generator], Floats]
"""Errors (M, K, n, 2) of a study of n clips."""


@dataclass(frozen=True, eq=False)
class SimulatedComparison:
    """L lines to be judged together."""

    differences: list[Floats]
    """Of each line (n,), a rise being worse."""
    margins: list[float]

    @property
    def worse(self) -> Bools:
        """(L,) which lines are called worse: `decide_verdicts` without the intervals that no verdict of worse can hang on."""
        p_holm = holm([sign_flip_p(line) for line in self.differences])
        lines = zip(self.differences, self.margins, p_holm, strict=True)
        return np.array([p <= SIGNIFICANCE and d.mean() > m and bootstrap_interval(d)[0] > 0.0 for d, m, p in lines])

    @property
    def verdicts(self) -> list[str]:
        return [found.verdict for found in decide_verdicts(self.differences, self.margins)]


def make_comparison(errors: Floats, margin: float = 1.0) -> SimulatedComparison:
    """Of errors (M, K, n, 2) of the methods by `METRICS`, with margins `margin` times as wide as they are."""
    lines = [(errors[m, k], metric) for m in range(len(errors)) for k, metric in enumerate(METRICS)]
    margins = [margin * margin_of(metric).of(float(line[:, 0].mean())) for line, metric in lines]
    return SimulatedComparison([line[:, 1] - line[:, 0] for line, _ in lines], margins)


def exchanged(people: ErrorPopulation, clips: int, rng: np.random.Generator) -> Floats:
    """Clips with replacement; a coin for each method and clip exchanges its sides."""
    picked = people.errors[:, :, rng.integers(0, len(people.clips), clips)]
    swap = rng.random((len(people.methods), 1, clips, 1)) < 0.5
    return np.where(swap, picked[..., ::-1], picked)


def heavy(people: ErrorPopulation, clips: int, rng: np.random.Generator) -> Floats:
    """The same with differences stretched by |Student's t of 2 degrees|: now and then a clip goes quite astray."""
    errors = exchanged(people, clips, rng)
    stretch = np.abs(rng.standard_t(2, (len(people.methods), 1, clips)))
    return np.stack([errors[..., 0], errors[..., 0] + stretch * (errors[..., 1] - errors[..., 0])], axis=-1)


def centred(people: ErrorPopulation, clips: int, rng: np.random.Generator) -> Floats:
    """No coin: each line's own mean difference over all stored clips is taken off, so that skew stays."""
    errors = people.errors.copy()
    errors[..., 1] -= (errors[..., 1] - errors[..., 0]).mean(axis=2, keepdims=True)
    return errors[:, :, rng.integers(0, len(people.clips), clips)]


def count_false_alarms(
    people: ErrorPopulation, clips: int, studies: int, seed: int, draw: Resampler = exchanged, margin: float = 1.0
) -> int:
    """How many of the studies call any line worse though none is."""
    rngs = (generator(seed, "gate", draw.__name__, clips, n) for n in range(studies))
    return sum(bool(make_comparison(draw(people, clips, rng), margin).worse.any()) for rng in rngs)


def detect_changes(
    people: ErrorPopulation, clips: int, studies: int, seed: int, change: float = RELATIVE_CHANGE
) -> Bools:
    """(studies,) whether the line that changed is called worse; lines take turns."""
    lines = len(people.methods) * len(METRICS)
    seen = []
    for n in range(studies):
        errors = exchanged(people, clips, generator(seed, "gate", "changed", clips, n))
        method, metric = divmod(n % lines, len(METRICS))
        errors[method, metric, :, 1] *= 1.0 + change
        seen.append(make_comparison(errors).worse[n % lines])
    return np.array(seen)


def share_called_same(people: ErrorPopulation, clips: int, studies: int, seed: int) -> float:
    """Share of the lines of studies without a change that are called the same; of the others nothing can be told."""
    rngs = (generator(seed, "gate", "exchanged", clips, n) for n in range(studies))
    verdicts = [make_comparison(exchanged(people, clips, rng)).verdicts for rng in rngs]
    return float(np.mean(np.array(verdicts) == "same"))


def interval_coverage(people: ErrorPopulation, clips: int, studies: int, seed: int) -> float:
    """Share of the 95 % intervals that hold the mean of all stored differences, from which clips are drawn."""
    difference = people.errors[..., 1] - people.errors[..., 0]
    held = []
    for n in range(studies):
        picked = generator(seed, "gate", "covered", clips, n).integers(0, len(people.clips), clips)
        for line in difference.reshape(-1, len(people.clips)):
            low, high = bootstrap_interval(line[picked])
            held.append(low <= line.mean() <= high)
    return float(np.mean(held))


def upper_confidence_rate(count: int, of: int) -> float:
    """The rate that is excluded with 95 % confidence when so many of so many came up (Clopper and Pearson 1934)."""
    return 1.0 if count == of else float(special.betaincinv(count + 1, of - count, 0.95))


def lower_confidence_rate(count: int, of: int) -> float:
    return 1.0 - upper_confidence_rate(of - count, of)


def bench_regression_gate(seed: int = 1) -> list[BenchmarkRow]:
    """False alarms, changes found, and how often intervals hold the truth."""
    settings, draws = load_population("settings"), load_population("draws")
    rows = [
        _false_alarm_row("false alarms, 24 clips", settings, 24, seed),
        _false_alarm_row("false alarms, 12 clips", settings, 12, seed),
        _false_alarm_row("false alarms, 8 clips", settings, 8, seed),
        _false_alarm_row("false alarms, 24 clips, heavy tails", settings, 24, seed, heavy),
        _false_alarm_row("false alarms, 24 clips, no coin", settings, 24, seed, centred),
        _false_alarm_row("false alarms, 24 clips, margins of 0", settings, 24, seed, margin=0.0),
        _false_alarm_row("false alarms, 24 clips, other noise in B", draws, 24, seed),
        _detection_row("3 % worse found, 24 clips", settings, 24, seed, held=True),
        _detection_row("3 % worse found, 12 clips", settings, 12, seed),
        _detection_row("3 % worse found, 24 clips, other noise in B", draws, 24, seed),
    ]
    for clips in (24, 12):
        share, beside = (
            100.0 * share_called_same(settings, clips, COVERAGE_COMPARISONS, seed),
            f"{COVERAGE_COMPARISONS} studies",
        )
        rows.append(BenchmarkRow(f"lines of equally good sides told the same, {clips} clips", share, "%", beside, ""))
    for clips in (24, 12, 8):
        share = 100.0 * interval_coverage(settings, clips, COVERAGE_COMPARISONS, seed)
        beside = f"nominally 95; {COVERAGE_COMPARISONS} studies of {len(METRICS) * len(settings.methods)} lines"
        rows.append(
            BenchmarkRow(f"intervals that hold the mean of all stored clips, {clips} clips", share, "%", beside, "")
        )
    return rows


def _false_alarm_row(
    name: str, people: ErrorPopulation, clips: int, seed: int, draw: Resampler = exchanged, margin: float = 1.0
) -> BenchmarkRow:
    count = count_false_alarms(people, clips, COMPARISONS, seed, draw, margin)
    beside = f"{count} of {COMPARISONS} studies, at most {100.0 * upper_confidence_rate(count, COMPARISONS):.1f} % with 95 % confidence"
    return BenchmarkRow(name, 100.0 * count / COMPARISONS, "%", beside, "<= 5")


def _detection_row(name: str, people: ErrorPopulation, clips: int, seed: int, *, held: bool = False) -> BenchmarkRow:
    seen = detect_changes(people, clips, CHANGED_COMPARISONS, seed)
    of_each = {metric: float(seen[k :: len(METRICS)].mean()) for k, metric in enumerate(METRICS)}
    each = ", ".join(f"{metric} {share:.0%}" for metric, share in of_each.items())
    count = int(seen.sum())
    beside = f"{count} of {CHANGED_COMPARISONS} studies, at least {100.0 * lower_confidence_rate(count, CHANGED_COMPARISONS):.0f} % with 95 %; {each}"
    return BenchmarkRow(name, 100.0 * count / CHANGED_COMPARISONS, "%", beside, ">= 90" if held else "")
