"""How much performers differ: the spread of made-up blocks, and that of the motion generator's performers."""

from pathlib import Path

import numpy as np
import pytest

from harness.bench import performers
from harness.bench.performers import NoLibrary, bench_performers
from harness.mocap import synthetic


def test_without_real_motion_it_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("HARNESS_MOCAP", raising=False)
    with pytest.raises(NoLibrary, match="HARNESS_MOCAP"):
        bench_performers()


def test_the_spread_between_is_without_the_one_within() -> None:
    """2 deg between 400 performers, 3 deg within, four hinges."""
    rng = np.random.default_rng(1)
    groups = [rng.normal(0.0, 2.0, 4) + rng.normal(0.0, 3.0, (5, 4)) for _ in range(400)]
    found = performers._spread(groups)
    assert np.exp(found.between) == pytest.approx(2.0, rel=0.1)
    assert np.exp(found.within) == pytest.approx(3.0, rel=0.05)
    assert 0.01 < found.error < 0.1
    alike = performers._spread([rng.normal(0.0, 3.0, (5, 4)) for _ in range(400)])
    assert np.exp(alike.between) < 0.6


@pytest.mark.long
def test_performers_with_a_style_differ_more_than_the_reference() -> None:
    source = performers._ShortTakes(seed=1)
    found = {}
    for title, group in (("styled", performers.STYLED[::4]), ("reference", synthetic.REFERENCE_PERFORMERS)):
        takes = {who: performers._synthetic_takes("walking", who) for who in group}
        found[title] = performers.spreads(source, takes, "walking")
    for part in performers.PARTS:
        name = f"mean angle of the {part}"
        assert found["styled"][name].between > found["reference"][name].between + np.log(1.5)
    assert any(name.startswith("phase") for name in found["styled"])


@pytest.mark.slow
def test_built_in_walkers_differ_as_real_ones(mocap: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The decisive rows: each spread of built-in walkers is within a factor of two of CMU's."""
    monkeypatch.setenv("HARNESS_MOCAP", str(mocap))
    rows = [row for row in bench_performers() if row.text.startswith("walking") and "CMU" in row.text]
    assert all(0.5 < row.value < 2.0 for row in rows if "built-in / CMU" in row.text and row.value is not None)
