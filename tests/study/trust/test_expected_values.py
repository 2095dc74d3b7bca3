"""Expected numbers of the preset and of a unit file, and components as dotted keys and back."""

import numpy as np
import pytest

from harness.compare import holm
from harness.core.fields import replace_fields
from harness.core.number_format import Interval
from harness.errors import BadInput
from harness.measure import UnitFile
from harness.simulate import Noise, noise_preset
from harness.study.trust.characterization import (
    check_departures,
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


EXACT_ONE = Interval(1.0, 1.0, 1.0)


def test_a_departure_is_named_after_the_correction_alone() -> None:
    measured = {(f"key {i}", ""): Interval.normal(1.0, 0.1) for i in range(30)}
    measured["odd", ""] = Interval.normal(1.3, 0.1)  # p = 0.0027, but there are 31 checks
    expected = dict.fromkeys(measured, EXACT_ONE)
    checks = check_departures(measured, expected)
    assert not any(check.is_named for check in checks)
    assert [check.p_holm for check in checks] == holm([check.p for check in checks])
    few = check_departures({key: one for key, one in measured.items() if key[0] in ("odd", "key 1")}, expected)
    assert [check.key for check in few if check.is_named] == ["odd"]


def test_a_station_is_compared_with_the_expectation_of_all() -> None:
    checks = check_departures({("x", "head"): Interval.normal(2.0, 0.1)}, {("x", ""): EXACT_ONE})
    assert checks[0].is_named
    assert checks[0].station == "head"


def test_what_was_not_measured_or_is_not_expected_is_no_check() -> None:
    measured = {("a", ""): Interval.missing("why"), ("b", ""): EXACT_ONE, ("c", ""): EXACT_ONE}
    expected = {("a", ""): EXACT_ONE, ("c", ""): Interval.missing("not in the earlier file")}
    assert check_departures(measured, expected) == []


def test_without_a_fault_one_study_in_twenty_names_something() -> None:
    rng = np.random.default_rng(3)
    named = 0
    for _ in range(400):
        measured = {(str(i), ""): Interval.normal(1.0 + 0.1 * rng.normal(), 0.1) for i in range(40)}
        named += any(check.is_named for check in check_departures(measured, dict.fromkeys(measured, EXACT_ONE)))
    assert 0.02 <= named / 400 <= 0.08
