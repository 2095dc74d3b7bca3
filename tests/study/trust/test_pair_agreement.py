"""Two sides: the order of pairs of arms, correlations of ranks, and equivalence; each verdict, and the level."""

import numpy as np
import pytest

from harness.core.seeds import generator
from harness.study.trust.pair_agreement import (
    ArmErrors,
    average_performers,
    clip_means,
    correlate_ranks,
    judge_equivalence,
    judge_pairs,
)

LEVEL, CLIPS, SEEDS = 0.05, 12, 5


def side(name: str, means: dict[str, float], draws: int, noise: float = 0.05, interaction: float = 0.5) -> ArmErrors:
    """Errors of arms: a mean, a part of the clip that both sides share, and noise of each draw."""
    rng, out = generator(1, name), {}
    for arm, mean in means.items():
        shared = interaction * generator(2, arm).normal(size=CLIPS)
        errors = mean + (shared - shared.mean())[:, None] + noise * rng.normal(size=(CLIPS, draws))
        out[arm] = {f"clip {k:02d}": row.tolist() for k, row in enumerate(errors)}
    return out


@pytest.mark.parametrize(
    ("device", "simulated", "verdict", "why"),
    [
        ((3.0, 3.3), (3.0, 3.3), "agree", "same order"),
        ((3.3, 3.0), (3.3, 3.0), "agree", "same order"),
        ((3.0, 3.3), (3.3, 3.0), "contradict", "other order"),
        ((3.0, 3.0), (3.0, 3.3), "cannot tell", "on the device"),
        ((3.0, 3.3), (3.0, 3.0), "cannot tell", "on the simulation"),
        ((3.0, 3.0), (3.0, 3.0), "cannot tell", "on the device and the simulation"),
    ],
)
def test_each_verdict(device: tuple[float, float], simulated: tuple[float, float], verdict: str, why: str) -> None:
    (found,) = judge_pairs(
        side("device", {"a": device[0], "b": device[1]}, 1, noise=0.1),
        side("simulation", {"a": simulated[0], "b": simulated[1]}, SEEDS, noise=0.1),
        LEVEL,
    )
    assert found.verdict == verdict
    assert why in found.why
    assert found.clips == CLIPS
    assert found.device.mean == pytest.approx(device[0] - device[1], abs=0.12)
    assert found.p is not None
    assert found.p_holm == found.p


def test_what_a_motion_does_to_both_sides_is_no_noise() -> None:
    """The scatter between clips is ten times the difference, which is found all the same."""
    device, simulated = (side(name, {"a": 3.0, "b": 3.2}, n, interaction=2.0) for name, n in (("d", 1), ("s", SEEDS)))
    (found,) = judge_pairs(device, simulated, LEVEL)
    assert found.verdict == "agree"
    scatter = np.std([device["a"][clip][0] - device["b"][clip][0] for clip in device["a"]])  # type: ignore[operator]
    assert scatter > 1.0
    assert found.device.low is not None
    assert found.device.high is not None
    assert found.device.high - found.device.low < 0.2


def test_a_simulation_that_is_wrong_from_clip_to_clip_widens_the_interval_of_the_device() -> None:
    device = side("d", {"a": 3.0, "b": 3.2}, 1)
    wrong = side("s", {"a": 3.0, "b": 3.2}, SEEDS)
    for k, clip in enumerate(wrong["a"]):
        wrong["a"][clip] = [value + (1.0 if k % 2 else -1.0) for value in wrong["a"][clip]]  # type: ignore[index, operator]
    (right,) = judge_pairs(device, side("s", {"a": 3.0, "b": 3.2}, SEEDS), LEVEL)
    (found,) = judge_pairs(device, wrong, LEVEL)
    assert right.verdict == "agree"
    assert found.verdict == "cannot tell"
    assert found.device.mean == right.device.mean


def test_the_interval_is_that_of_students_t() -> None:
    device: ArmErrors = {"a": {f"{k}": [1.0 + 0.1 * k] for k in range(6)}, "b": {f"{k}": [0.0] for k in range(6)}}
    simulated: ArmErrors = {"a": {f"{k}": [1.0] for k in range(6)}, "b": {f"{k}": [0.0] for k in range(6)}}
    (found,) = judge_pairs(device, simulated, LEVEL)
    deviation = 0.1 * np.sqrt(3.5) / np.sqrt(6.0)
    assert found.device.mean == pytest.approx(1.25)
    assert found.device.high == pytest.approx(1.25 + 2.015048 * deviation, rel=1e-5)
    assert found.device.p == pytest.approx(7.768e-6, rel=1e-3)  # t = 16.37 with 5 degrees of freedom, one side
    assert found.simulated.mean == 1.0
    assert found.simulated.high == pytest.approx(1.0 + 2.015048 * deviation, rel=1e-5)  # one seed: the device's scatter


def test_the_noise_of_the_simulation_is_that_of_its_seeds() -> None:
    device: ArmErrors = {
        "a": {f"{k}": [2.0 + 0.3 * (-1) ** k] for k in range(6)},
        "b": {f"{k}": [0.0] for k in range(6)},
    }
    simulated: ArmErrors = {"a": {f"{k}": [0.9, 1.1] for k in range(6)}, "b": {f"{k}": [0.0, 0.0] for k in range(6)}}
    (found,) = judge_pairs(device, simulated, LEVEL)
    deviation = np.sqrt(0.02 / 2.0 / 6.0)
    assert found.simulated.low == pytest.approx(1.0 - 1.943180 * deviation, rel=1e-5)  # t with 6 degrees of freedom


def test_holm_counts_every_pair() -> None:
    means = {"a": 3.0, "b": 3.09, "c": 4.0, "d": 5.0, "e": 6.0}
    pairs = judge_pairs(side("d", means, 1, noise=0.3), side("s", means, SEEDS, noise=0.3), LEVEL)
    assert len(pairs) == 10
    first = pairs[0]
    assert (first.a, first.b) == ("a", "b")
    assert first.p is not None
    assert first.p_holm is not None
    assert first.p == max(pair.p or 0.0 for pair in pairs)
    assert first.p_holm == pytest.approx(first.p)  # the largest p of all is multiplied by one
    smallest = min(pairs, key=lambda pair: pair.p or 1.0)
    assert smallest.p is not None
    assert 0.0 < smallest.p < 0.1
    assert smallest.p_holm == pytest.approx(10.0 * smallest.p, rel=1e-9)


def test_only_named_pairs_are_judged() -> None:
    means = {"a": 3.0, "b": 3.3, "c": 4.0}
    pairs = judge_pairs(side("d", means, 1), side("s", means, SEEDS), LEVEL, [("c", "a")])
    assert [(pair.a, pair.b, pair.verdict) for pair in pairs] == [("c", "a", "agree")]


def test_a_pair_uses_the_captures_and_seeds_that_both_arms_have() -> None:
    device = side("d", {"a": 3.0, "b": 3.3}, 2)
    simulated = side("s", {"a": 3.0, "b": 3.3}, SEEDS)
    clips = list(device["a"])
    device["a"][clips[0]] = [None, device["a"][clips[0]][1]]  # type: ignore[index]
    simulated["b"][clips[1]] = [None] * SEEDS  # type: ignore[index]
    (found,) = judge_pairs(device, simulated, LEVEL)
    assert (found.clips, found.verdict) == (CLIPS - 1, "agree")


def test_five_clips_are_too_few() -> None:
    device, simulated = (side(name, {"a": 3.0, "b": 9.0}, n) for name, n in (("d", 1), ("s", SEEDS)))
    few = {arm: dict(list(clips.items())[:5]) for arm, clips in device.items()}
    (found,) = judge_pairs(few, simulated, LEVEL)
    assert (found.verdict, found.p, found.device.low) == ("cannot tell", None, None)
    assert "too few units: 5" in found.why
    (none,) = judge_pairs({"a": {}, "b": {}}, simulated, LEVEL)
    assert (none.clips, none.device.mean) == (0, None)


def test_errors_without_any_noise_are_ordered_and_equal_ones_are_not() -> None:
    same: ArmErrors = {arm: {f"{k}": [value] for k in range(6)} for arm, value in (("a", 1.0), ("b", 2.0), ("c", 2.0))}
    verdicts = {(pair.a, pair.b): pair.verdict for pair in judge_pairs(same, same, LEVEL)}
    assert verdicts == {("a", "b"): "agree", ("a", "c"): "agree", ("b", "c"): "cannot tell"}


@pytest.mark.long
def test_false_contradictions_are_rarer_than_the_level() -> None:
    """The worst case: no difference on the device, and a clear one in the simulation."""
    contradicted, agreed, studies = 0, 0, 1000
    for study in range(studies):
        rng = generator(study, "level")
        device, simulated = (
            {
                arm: {f"{k}": row for k, row in enumerate((mean + 0.1 * rng.normal(size=(CLIPS, n))).tolist())}
                for arm, mean in means.items()
            }
            for means, n in (({"a": 3.0, "b": 3.0}, 1), ({"a": 3.0, "b": 3.5}, SEEDS))
        )
        (found,) = judge_pairs(device, simulated, LEVEL)
        contradicted += found.verdict == "contradict"
        agreed += found.verdict == "agree"
    assert 10 <= contradicted <= 70
    assert 10 <= agreed <= 70


def test_rank_correlations_of_equal_and_of_reversed_orders() -> None:
    means = {"a": 1.0, "b": 2.0, "c": 3.0, "d": 5.0}
    device = side("d", means, 1)
    tau, pearson = correlate_ranks(device, side("s", means, SEEDS))
    assert tau.value == 1.0
    assert pearson.value == pytest.approx(1.0, abs=0.01)
    assert pearson.low is not None
    assert pearson.high is not None
    assert pearson.value is not None
    assert pearson.low <= pearson.value <= pearson.high + 1e-12
    tau, pearson = correlate_ranks(device, side("s", dict(zip(means, reversed(means.values()), strict=True)), SEEDS))
    assert tau.value == -1.0
    assert pearson.value is not None
    assert pearson.value < -0.7


def test_rank_correlations_need_three_arms_six_clips_and_a_difference() -> None:
    two = {"a": 1.0, "b": 2.0}
    tau, _ = correlate_ranks(side("d", two, 1), side("s", two, 1))
    assert (tau.value, tau.reason) == (None, "2 arms and 12 units, of at least 3 and 6")
    equal: ArmErrors = {arm: {f"{k}": [1.0] for k in range(6)} for arm in "abc"}
    for found in correlate_ranks(equal, equal):
        assert found.value is None
        assert "same error" in found.reason


def test_means_leave_out_what_was_not_measured() -> None:
    assert clip_means({"x": [1.0, None, 3.0], "y": [None], "z": []}) == {"x": 2.0}


def test_clips_of_a_performer_are_one_unit() -> None:
    errors: ArmErrors = {"ik": {"a": [1.0, 3.0], "b": [5.0, 7.0], "c": [2.0, None]}}
    both = {"a": "Anna", "b": "Anna"}
    seeds = average_performers(errors, both, paired=True)
    assert seeds == {"ik": {"performer Anna": [3.0, 5.0], "c": [2.0, None]}}
    captures = average_performers(errors, both, paired=False)
    assert captures == {"ik": {"performer Anna": [4.0], "c": [2.0, None]}}
    missing = average_performers(errors, {"a": "Anna", "c": "Anna"}, paired=True)
    assert missing["ik"]["performer Anna"] == [1.5, None]
    assert average_performers(errors, {}, paired=False) == errors


MARGIN = 1.0
SCATTER = np.linspace(-0.3, 0.3, 12)


def metric_sides(shift: float, scatter: float = 1.0) -> tuple[dict[str, float], dict[str, float]]:
    """Device and simulation of twelve clips; the simulation is larger by `shift`."""
    device = {f"clip {k:02d}": 5.0 + k for k in range(12)}
    return device, {clip: error + shift + scatter * SCATTER[k] for k, (clip, error) in enumerate(device.items())}


@pytest.mark.parametrize(
    ("shift", "scatter", "verdict"),
    [
        (0.0, 1.0, "equivalent"),
        (0.8, 1.0, "equivalent"),
        (-0.8, 1.0, "equivalent"),
        (1.0, 1.0, "cannot tell"),
        (0.0, 20.0, "cannot tell"),
        (1.2, 1.0, "beyond the margin"),
        (-1.2, 1.0, "beyond the margin"),
        (1.2, 3.0, "cannot tell"),
    ],
)
def test_each_verdict_of_equivalence(shift: float, scatter: float, verdict: str) -> None:
    found = judge_equivalence("ik", "mpjpe_mm", *metric_sides(shift, scatter), MARGIN, LEVEL)
    assert found.verdict == verdict
    assert found.difference == pytest.approx(shift)
    assert found.device == pytest.approx(10.5)
    assert found.simulated == pytest.approx(10.5 + shift)
    assert found.low is not None
    assert found.high is not None
    assert found.low < shift < found.high


def test_a_lower_level_widens_the_interval() -> None:
    wide, narrow = (judge_equivalence("ik", "mpjpe_mm", *metric_sides(0.0), MARGIN, level) for level in (0.01, 0.1))
    assert wide.low is not None
    assert narrow.low is not None
    assert wide.low < narrow.low


@pytest.mark.parametrize(("level", "quantile"), [(0.05, 1.795885), (0.01, 2.718079)])
def test_the_interval_has_the_level_of_two_one_sided_tests(level: float, quantile: float) -> None:
    """About that of Student's t with eleven degrees of freedom, since the scatter is even."""
    found = judge_equivalence("ik", "mpjpe_mm", *metric_sides(0.0), MARGIN, level)
    assert found.high == pytest.approx(quantile * SCATTER.std(ddof=1) / np.sqrt(12.0), rel=0.05)


def test_few_clips_and_clips_of_one_side_are_undecided() -> None:
    device, simulated = metric_sides(0.0)
    few = dict(list(simulated.items())[:5])
    found = judge_equivalence("ik", "mpjpe_mm", device, few, MARGIN, LEVEL)
    assert (found.clips, found.verdict, found.low) == (5, "cannot tell", None)
    assert "too few units: 5" in found.why
    empty = judge_equivalence("ik", "mpjpe_mm", device, {"another": 1.0}, MARGIN, LEVEL)
    assert (empty.clips, empty.difference, empty.verdict) == (0, None, "cannot tell")


@pytest.mark.long
def test_at_the_edge_equivalence_is_declared_in_about_the_share_of_the_level() -> None:
    rng, declared = generator(1, "edge"), 0
    for k in range(400):
        edge = MARGIN if k % 2 else -MARGIN
        device = {f"clip {c}": 0.0 for c in range(12)}
        simulated = {clip: edge + 0.5 * float(rng.normal()) for clip in device}
        declared += judge_equivalence("ik", "mpjpe_mm", device, simulated, MARGIN, LEVEL).verdict == "equivalent"
    assert 5 <= declared <= 36
