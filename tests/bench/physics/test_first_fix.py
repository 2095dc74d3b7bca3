"""The rows of the first fix count what made-up starts show."""

from types import SimpleNamespace

import numpy as np
import pytest

from harness.bench import common
from harness.bench.physics import first_fix
from harness.simulate import Noise

CHEST = common.STATIONS.index(first_fix.STATION)


def start(without: bool = False, error_m: float = 0.0) -> tuple[SimpleNamespace, SimpleNamespace]:
    """Ten readings of a chest that is lost for eight of them, or for all, and is off at the last one."""
    true = np.zeros((10, len(common.STATIONS), 3))
    found, quality = true.copy(), np.ones(true.shape[:2])
    found[:, :CHEST, 0] = 0.002
    found[0, CHEST] = 5.0  # while it is lost
    found[-1, CHEST, 2] = error_m
    quality[: 10 if without else 8, CHEST] = 0.0
    coverage = SimpleNamespace(coverage_share=np.full(len(common.STATIONS), 0.9))
    return SimpleNamespace(position_m=found, quality=quality, filter=coverage), SimpleNamespace(position_m=true)


@pytest.mark.parametrize(
    ("without", "wrong", "verdicts"), [(1, 0, "met met"), (2, 0, "missed met"), (0, 1, "met missed")]
)
def test_starts_are_counted(without: int, wrong: int, verdicts: str, monkeypatch: pytest.MonkeyPatch) -> None:
    seeds = []

    def simulate(behaviour: str, seed: int, seconds: float, noise: Noise) -> tuple[SimpleNamespace, SimpleNamespace]:
        seeds.append(seed)
        k = len(seeds)
        return start(k <= without, 0.2 if k > first_fix.STARTS - wrong else 0.09)

    monkeypatch.setattr(first_fix, "simulate_performer", simulate)
    lost, never, error, others = first_fix.first_fix_rows((3,))
    assert seeds == list(range(2021, 2031))
    assert lost.measured == f"{0.8 + 0.02 * without:.1%}; it hears three emitters or more for 90.0%"
    assert (lost.verdict, f"{never.verdict} {error.verdict}") == ("missed", verdicts)
    assert never.measured == str(without)
    assert error.measured == f"{wrong}; the largest error is {200 if wrong else 90} mm"
    assert others.measured == "2.00, 2.00, 2.00, 2.00, 0.00 mm"
