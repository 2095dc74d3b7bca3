"""Parameters of episodes: the preset is covered, three times as many excursions are seen, noise has none."""

from dataclasses import replace

import pytest

from harness.measure.episode_fit import EXCURSION_RATE, fit_episodes
from harness.measure.gauss_markov import ErrorProcess
from harness.simulate import noise_preset
from tests.measure.resting_stations import QUIET, at_rest

NOISE = ErrorProcess(0.00075, 0.0015, 1.0)


def test_noise_alone_has_no_episodes() -> None:
    fit = fit_episodes(at_rest(QUIET, 1, stations=("a", "b")), NOISE)
    for key in (EXCURSION_RATE, "components.echo.share", "components.dropout.share"):
        assert fit.parameters[key].value == 0.0
        assert fit.parameters[key].high > 0.0
    assert not any(one.disturbed.any() for one in fit.found)


@pytest.mark.long
@pytest.mark.parametrize("rate", [1.0, 3.0])
def test_rates_and_sizes_of_the_preset_are_found(rate: float) -> None:
    preset = noise_preset("default")
    assert preset.excursion
    noise = replace(preset, session=None, excursion=replace(preset.excursion, onsets_per_min=rate))
    fit = fit_episodes(at_rest(noise, 3, seconds=600.0, stations=tuple("abcdef")), NOISE)
    found = fit.parameters[EXCURSION_RATE]
    assert found.contains(rate) or found.value == pytest.approx(rate, rel=0.2)
    assert fit.parameters["components.echo.share"].value == pytest.approx(0.03, rel=0.2)
    assert fit.parameters["components.echo.burst_records.1"].value == 8
    assert fit.means["components.excursion.size_m"].value == pytest.approx(0.0175, rel=0.2)
    assert fit.means["components.excursion.stay_s"].value == pytest.approx(3.0, rel=0.15)
    assert fit.parameters["components.dropout.coast_s"].value == pytest.approx(0.5, rel=0.01)
