"""Planted worlds of a trust study: what its verdicts find where the answer is known. No method runs.

A world has twelve clips, drawn with replacement from stored ones. The device gets the errors of one stored draw of the
noise for each clip. The simulation gets those of others. Methods of one draw share it, as those on one capture do.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from harness.bench.lab.captures import needed_captures
from harness.bench.limits import state_verdict
from harness.bench.stored_errors import METRICS, load_planted_errors
from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.results.findings import BenchmarkStatement
from harness.study.trust.pair_agreement import ArmErrors, clip_means, judge_equivalence, judge_pairs

CLIPS = 12
SIMULATED_SEEDS = 5
LEVEL = 0.05
SWAPPED = 1.05
"""Ratio of the errors of two methods on the device; in the simulation it is the inverse."""
MARGIN = 0.1
"""Margin of the worlds of equivalence, relative to the mean error."""
SEEDS = tuple(range(1, 101))
"""Seeds of the plans."""
METHODS = ("ik", "best_match+ik", "kernel_ridge", "local_pca", "dynamic_map")
CHANGED = ("local_pca", "local_pca[neighbours=280]")
"""A method and the same method with one constant changed."""
RELATED = ("dynamic_map", "local_pca")
"""The two different methods whose errors are nearest to each other."""


def trust_rows(seeds: Sequence[int] = SEEDS) -> list[BenchmarkStatement]:
    """The rows of the truth table on trust, one plan for each seed."""
    return [same_profile_row(seeds), swapped_row(seeds), *further_swapped_rows(seeds), *equivalence_rows(seeds)]


def same_profile_row(seeds: Sequence[int]) -> BenchmarkStatement:
    """Plans of five methods, whose errors have one distribution on both sides."""
    without = sum(
        all(pair.verdict != "contradict" for pair in judge_pairs(*draw_world(seed, METHODS), LEVEL)) for seed in seeds
    )
    needed = needed_captures(len(seeds), 0.95)
    note = f"{len(METHODS)} methods, {CLIPS} clips, one capture of each, {SIMULATED_SEEDS} seeds"
    return _least_row("trust, same profile on both sides: no pair contradicts", without, needed, seeds, note)


def swapped_row(seeds: Sequence[int]) -> BenchmarkStatement:
    """Two different methods, which each plan draws anew, swapped by 5 %."""
    pairs = list(combinations(METHODS, 2))
    found = sum(
        finds_swap(seed, pairs[generator(seed, "swapped pair").integers(len(pairs))], captures=1) for seed in seeds
    )
    needed, scatter = needed_captures(len(seeds), 0.8), typical_scatter()
    note = (
        f"the difference of two methods scatters by {scatter:.0%} of the error from one draw of the tracker's noise to "
        f"the next, and {CLIPS} captures leave {scatter / np.sqrt(CLIPS):.1%}"
    )
    return _least_row("trust, two methods swapped by 5 %: the pair contradicts", found, needed, seeds, note)


def _least_row(name: str, found: int, needed: int, seeds: Sequence[int], note: str) -> BenchmarkStatement:
    held_to = f"in {needed} of {len(seeds)} plans or more"
    return state_verdict(name, held_to, f"in {found}", found >= needed, "", note)


def typical_scatter() -> float:
    """Median over pairs of methods of the standard deviation over draws of their difference, relative to the error."""
    stored = load_planted_errors()
    found = []
    for a, b in combinations(METHODS, 2):
        difference = stored[a] / stored[a].mean() - stored[b] / stored[b].mean()
        found.append(float(np.sqrt(difference.var(axis=1, ddof=1).mean())))
    return float(np.median(found))


def further_swapped_rows(seeds: Sequence[int]) -> list[BenchmarkStatement]:
    """The rows of two swapped methods for pairs of given likeness and two captures of each clip, without a verdict."""
    cases = [
        ("the same method with one constant changed", CHANGED, 1),
        ("the two methods nearest to each other", RELATED, 1),
        ("the same two methods, two captures of each clip", RELATED, 2),
    ]
    rows = []
    for name, pair, captures in cases:
        found = sum(finds_swap(seed, pair, captures) for seed in seeds)
        title = f"the same, {name}"
        rows.append(state_verdict(title, "", f"in {found} of {len(seeds)}", None, "", " and ".join(pair)))
    return rows


def equivalence_rows(seeds: Sequence[int]) -> list[BenchmarkStatement]:
    """Equivalence where the true difference is the margin, and where it is zero."""
    declared = {
        shift: sum(declares_equivalence(seed, shift * (-1.0) ** seed) for seed in seeds) for shift in (1.0, 0.0)
    }
    most, name = len(seeds) // 10, "trust, true difference at the margin's edge: equivalence declared"
    held_to, note = f"in {most} of {len(seeds)} plans or fewer", f"{RELATED[0]}, margin {MARGIN:.0%} of its mean error"
    return [
        state_verdict(name, held_to, f"in {declared[1.0]}", declared[1.0] <= most, "", note),
        state_verdict("the same, no true difference", "", f"in {declared[0.0]} of {len(seeds)}", None),
    ]


def draw_world(
    seed: int, methods: Sequence[str], *, ratios: tuple[float, float] | None = None, captures: int = 1
) -> tuple[ArmErrors, ArmErrors]:
    """Errors of the device and of the simulation in one world [deg].

    With `ratios`, for two methods, the errors of the second are scaled so that its mean over clips and stored draws is
    that of the first times the ratio: on the device, and in the simulation.
    """
    stored = load_planted_errors()
    clips, draws = stored[methods[0]].shape
    rng = generator(seed, "planted world", *methods)
    chosen = rng.integers(0, clips, CLIPS)
    shuffled = rng.permuted(np.tile(np.arange(draws), (CLIPS, 1)), axis=1)
    parts = shuffled[:, :captures], shuffled[:, captures : captures + SIMULATED_SEEDS]
    errors = {method: stored[method][chosen] for method in methods}
    factors = [dict.fromkeys(methods, 1.0) for _ in parts]
    if ratios is not None:
        first, second = (float(errors[method].mean()) for method in methods)
        for factor, ratio in zip(factors, ratios, strict=True):
            factor[methods[1]] = ratio * first / second
    device, simulated = (
        {method: _by_clip(factor[method] * np.take_along_axis(errors[method], part, axis=1)) for method in methods}
        for factor, part in zip(factors, parts, strict=True)
    )
    return device, simulated


def _by_clip(errors: Floats) -> dict[str, list[float]]:
    return {f"clip {number:02d}": row.tolist() for number, row in enumerate(errors)}


def finds_swap(seed: int, pair: tuple[str, str], captures: int) -> bool:
    """Whether a plan finds that two methods are swapped."""
    world = draw_world(seed, pair, ratios=(SWAPPED, 1.0 / SWAPPED), captures=captures)
    return judge_pairs(*world, LEVEL)[0].verdict == "contradict"


def declares_equivalence(seed: int, shift: float) -> bool:
    """Whether a plan declares equivalence where the simulation's error is larger by `shift` margins."""
    method = RELATED[0]
    device, simulated = (clip_means(side[method]) for side in draw_world(seed, (method,)))
    margin = MARGIN * float(load_planted_errors()[method].mean())
    shifted = {clip: error + shift * margin for clip, error in simulated.items()}
    return judge_equivalence(method, METRICS[0], device, shifted, margin, LEVEL).verdict == "equivalent"
