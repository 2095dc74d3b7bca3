"""What is kept of the blocks of a capture, without the fit of the noise: stretches, rests, and motion for the bar."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from harness.core import rotations
from harness.core.number_format import Interval
from harness.errors import BadFile, BadInput
from harness.measure.gauss_markov import NOISE_KEYS
from harness.measure.noise_fit import NoiseFit
from harness.measure.profile import Bar, UnitProfile, measure_profile
from harness.stream.recording import CaptureBlock, StationReadings
from tests.measure.resting_stations import QUIET
from tests.measure.test_rigid_pair import LEVER_M, sweep
from tests.measure.test_timing import capture

BAR = ("one", "two")
_BAR = Bar(BAR)


@pytest.fixture(autouse=True)
def _without_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whose fit takes seconds and has tests of its own."""
    noise = NoiseFit(dict.fromkeys(NOISE_KEYS, Interval.missing("not fitted")), {})
    monkeypatch.setattr("harness.measure.profile.fit_rest", lambda rest, progress: (noise, SimpleNamespace(found=())))


def profile(*blocks: CaptureBlock, bar: Bar | None = _BAR) -> UnitProfile:
    reader: Any = SimpleNamespace(
        path=Path("a.rec"), wire=blocks[0].wire, note="by hand", damage=[], blocks=lambda: iter(blocks)
    )
    return measure_profile(reader, bar=bar)


def moved(at_rest: CaptureBlock) -> CaptureBlock:
    """The bar swings for a minute; three readings in a hundred lack their stamp, place or turn, or are suspect."""
    time_s = np.arange(2400) / 40.0
    place, _, turn = sweep(time_s)
    out = {}
    for number, station in enumerate(BAR):
        from_bar = place + rotations.rotate(turn, number * LEVER_M)
        measured_s, here, turned, suspect = time_s.copy(), from_bar.copy(), turn.copy(), np.zeros(2400, bool)
        measured_s[100::400], here[200::400], turned[300::400], suspect[50::400] = np.nan, np.nan, np.nan, True
        here[50::400] = 9.0
        out[station] = StationReadings(time_s, measured_s, measured_s, here, turned, np.ones(2400), suspect)
    return replace(at_rest, stretch="slow", stations={**at_rest.stations, **out})


def test_stretches_are_listed_and_motion_measures_the_bar() -> None:
    rest = capture(1, 40.0, noise=QUIET)
    found = profile(rest, moved(rest))
    assert found.rigid is not None
    assert found.rigid.length_m.value == pytest.approx(float(np.linalg.norm(LEVER_M)), abs=1e-4)
    assert [one.name for one in found.stretches] == ["static", "slow"]
    assert found.stretches[0].duration_s == pytest.approx(40.0, abs=0.1)
    assert found.stretches[0].records == 6 * 1600


def test_a_bar_that_only_moves_is_measured_without_noise() -> None:
    """ASTM E3064: its length in four places, and nothing that a rest would show."""
    rest = capture(1, 40.0, noise=QUIET)
    alone = moved(rest)
    found = profile(replace(alone, stations={name: alone.stations[name] for name in BAR}))
    assert found.rigid is not None
    assert found.rigid.length_m.value == pytest.approx(float(np.linalg.norm(LEVER_M)), abs=1e-4)
    assert len(found.rigid.places) == 4
    assert found.noise.all_stations[NOISE_KEYS[0]].reason == "No station rests for 10 s."
    assert found.rest == ()


def test_a_capture_without_motion_or_without_rest_is_refused() -> None:
    rest = capture(1, 40.0, noise=QUIET)
    with pytest.raises(BadInput, match="one and two have 0 s of common readings"):
        profile(rest)
    with pytest.raises(BadFile, match="no stretch in which a station rests"):
        profile(replace(rest, stretch="slow"), bar=None)
