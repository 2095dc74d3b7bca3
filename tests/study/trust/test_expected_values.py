"""Expected numbers of the preset and of a unit file, and components as dotted keys and back."""

import pytest

from harness.core.fields import replace_fields
from harness.core.number_format import Interval
from harness.errors import BadInput
from harness.measure.unit_file import UnitFile
from harness.simulate.noise import Noise, noise_preset
from harness.study.trust.expected_values import (
    flatten_components,
    nest_components,
    preset_components,
    preset_values,
    unit_values,
)


def test_the_components_of_the_preset_give_the_preset_back() -> None:
    assert replace_fields(Noise(), preset_components(), "components") == noise_preset("default")
    flat = dict(flatten_components(preset_components()))
    assert nest_components(flat, preset_components()) == preset_components()


def test_changed_numbers_are_put_in_their_places() -> None:
    changed = nest_components(
        {"components.white.position_m": 0.002, "components.echo.burst_records.1": 12.4}, preset_components()
    )
    noise = replace_fields(noise_preset("default"), changed, "components")
    assert noise.white is not None
    assert noise.white.position_m == 0.002
    assert noise.echo is not None
    assert noise.echo.burst_records == (1, 12)
    assert preset_components()["white"]["position_m"] == 0.00075


def test_the_mean_of_a_uniform_distribution_is_expected_too() -> None:
    values = preset_values()
    assert values["components.excursion.size_m"].value == pytest.approx(0.0175)
    assert values["components.echo.share"] == Interval(0.03, 0.03, 0.03)


def test_an_earlier_unit_is_expected_with_its_intervals() -> None:
    measured = {
        "components.echo.share": Interval(0.05, 0.04, 0.06, 100),
        "components.echo.size_m": Interval(0.2, 0.19, 0.21, 100),
        "components.echo.size_m.0": Interval(0.1, 0.09, 0.11, 100),
        "components.echo.size_m.1": Interval(0.3, 0.29, 0.31, 100),
    }
    values = unit_values(UnitFile("u", {"echo": {"share": 0.05}}, {}, measured))
    assert values == measured
    with pytest.raises(BadInput, match="share"):
        unit_values(UnitFile("u", {"echo": {"share": -0.05}}, {}, measured))
