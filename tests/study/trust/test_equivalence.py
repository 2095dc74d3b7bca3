"""Equivalence by two one-sided tests: each verdict, and how often it is wrong at the margin's edge."""

import numpy as np
import pytest

from harness.core.seeds import generator
from harness.study.trust.equivalence import judge_equivalence

MARGIN, LEVEL = 1.0, 0.05
SCATTER = np.linspace(-0.3, 0.3, 12)


def sides(shift: float, scatter: float = 1.0) -> tuple[dict[str, float], dict[str, float]]:
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
def test_each_verdict(shift: float, scatter: float, verdict: str) -> None:
    found = judge_equivalence("ik", "mpjpe_mm", *sides(shift, scatter), MARGIN, LEVEL)
    assert found.verdict == verdict
    assert found.difference == pytest.approx(shift)
    assert found.device == pytest.approx(10.5)
    assert found.simulated == pytest.approx(10.5 + shift)
    assert found.low is not None
    assert found.high is not None
    assert found.low < shift < found.high


def test_a_lower_level_widens_the_interval() -> None:
    wide, narrow = (judge_equivalence("ik", "mpjpe_mm", *sides(0.0), MARGIN, level) for level in (0.01, 0.1))
    assert wide.low is not None
    assert narrow.low is not None
    assert wide.low < narrow.low


@pytest.mark.parametrize(("level", "quantile"), [(0.05, 1.795885), (0.01, 2.718079)])
def test_the_interval_has_the_level_of_two_one_sided_tests(level: float, quantile: float) -> None:
    """About that of Student's t with eleven degrees of freedom, since the scatter is even."""
    found = judge_equivalence("ik", "mpjpe_mm", *sides(0.0), MARGIN, level)
    assert found.high == pytest.approx(quantile * SCATTER.std(ddof=1) / np.sqrt(12.0), rel=0.05)


def test_few_clips_and_clips_of_one_side_are_undecided() -> None:
    device, simulated = sides(0.0)
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
