"""Units and the order of a quaternion, from numbers alone."""

import numpy as np
import pytest

from harness.core import rotations
from harness.stream.poses.evidence import (
    conclude_angle_unit,
    conclude_length_unit,
    conclude_quaternion_order,
    conclude_resolution,
    conclude_time_unit,
    counts_samples,
    explained_by_lever_arm,
)
from tests.stream.poses.pose_files import POSITIONS_M, QUATERNIONS, TIMES_S, XYZW

SLOW = np.linspace(0.0, 4.8, 9)
"""1.7 Hz in seconds, or 1.7 kHz in milliseconds."""


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
@pytest.mark.parametrize("start_s", [0.0, 1.5e9])
@pytest.mark.parametrize("step_s", [0.002, 0.01, 0.1])
def test_the_size_of_steps_shows_the_unit_of_time(unit: str, start_s: float, step_s: float) -> None:
    length_s = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}[unit]
    found = conclude_time_unit((start_s + step_s * np.arange(50.0)) / length_s, "", None)
    assert (found.value, found.assumed) == (unit, False)
    assert ("Unix time of 2017-07-14" in found.reason) == (start_s > 0.0)


def test_ticks_of_the_year_1_are_known() -> None:
    found = conclude_time_unit(638_000_000_000_000_000 + 200_000 * np.arange(50.0), "", None)
    assert (found.value, found.assumed) == ("100ns", False)
    assert conclude_time_unit(1e5 * np.arange(50.0), "", None).value == "us"  # 10 Hz; 100 Hz in ticks


def test_a_step_that_may_be_two_units_is_an_assumption() -> None:
    assert conclude_time_unit(SLOW, "", None).assumed
    assert conclude_time_unit(np.zeros(1), "", None).assumed
    assert conclude_time_unit(SLOW, "s", None).reason == "the column's name"
    assert conclude_time_unit(SLOW, "s", "ms").value == "ms"


@pytest.mark.parametrize("size", [1.0, 5.0, 15.0, 60.0, 900.0, 3000.0])
def test_units_are_alternatives_where_their_sizes_are_usual(size: float) -> None:
    rest = np.array([size, 0.0, 0.0]) + np.zeros((50, 3))
    found, _ = conclude_length_unit(rest, np.arange(50) / 50.0, "", None)
    others = {1.0: "", 5.0: "", 15.0: "in", 60.0: "cm or in", 900.0: "cm", 3000.0: ""}[size]
    assert (f"; {others} would fit as well: --unit decides" if others else "") in found.reason
    assert ("fit as well" in found.reason) == bool(others)


def test_units_of_angles() -> None:
    assert conclude_angle_unit(np.array([6.29, -1.0]), "", "").value == "rad"
    assert conclude_angle_unit(np.array([1.0, -6.4, np.nan]), "", "").value == "deg"
    assert conclude_angle_unit(np.array([]), "deg", "").reason == "the columns' names"
    assert conclude_angle_unit(np.array([]), "deg", "rad").value == "rad"


@pytest.mark.parametrize("scale", [1.0, 1e9])
@pytest.mark.parametrize("start_s", [0.0, 1.49e9])
def test_times_that_were_rounded_show_their_resolution(scale: float, start_s: float) -> None:
    true_s = start_s + np.arange(200) / 30.0
    found = conclude_resolution(np.round(true_s, 2) * scale, 1.0 / scale)
    assert found is not None
    assert found.value == "10 ms, where the median step is 30 ms"
    assert conclude_resolution(np.round(true_s, 4) * scale, 1.0 / scale) is None


def test_even_times_show_no_resolution() -> None:
    even = np.delete(np.arange(100) / 50.0, [7, 8, 40])  # with gaps
    assert conclude_resolution(even, 1.0) is None
    assert conclude_resolution(even[:1], 1.0) is None


def test_whole_steps_of_one_are_numbers_of_samples() -> None:
    assert counts_samples(np.array([4.0, 5.0, 6.0, 9.0, 10.0]))
    assert not counts_samples(np.array([0.5, 1.5, 2.5]))
    assert not counts_samples(np.array([0.0, 10.0, 20.0]))
    assert not counts_samples(np.zeros(1))


@pytest.mark.parametrize(
    ("unit_m", "name", "assumed"),
    [(1.0, "m", False), (0.001, "mm", False), (0.01, "cm", True), (0.0254, "cm", True)],
)
def test_sizes_and_speeds_show_the_unit_of_length(unit_m: float, name: str, assumed: bool) -> None:
    found, _ = conclude_length_unit(POSITIONS_M / unit_m, TIMES_S, "", None)
    assert (found.value, found.assumed) == (name, assumed)


def test_what_rests_far_away_is_in_millimetres() -> None:
    rest = np.array([900.0, -300.0, 1500.0]) + np.zeros((100, 3))
    found, unit_m = conclude_length_unit(rest, np.arange(100) / 50.0, "", None)
    assert (found.value, unit_m, found.assumed) == ("mm", 0.001, True)
    assert conclude_length_unit(rest, None, "", None)[0].value == "mm"
    road = np.stack([15.0 * np.arange(100), np.zeros(100), np.zeros(100)], axis=1)  # a car
    assert conclude_length_unit(road, np.arange(100.0), "", None)[0].value == "m"
    found, unit_m = conclude_length_unit(rest + np.array([4e5, 5.4e6, 0.0]), np.arange(100.0), "", None)  # a map
    assert (found.value, unit_m, found.assumed) == ("m", 1.0, True)


def test_metres_are_named_beside_the_unit_of_a_file_without_times() -> None:
    matrices = np.linspace(0.0, 450.0, 100)[:, None] * np.array([1.0, 0.0, 0.5])
    found, _ = conclude_length_unit(matrices, None, "", None)
    assert found.value == "mm"
    assert "m or cm or in would fit" in found.reason


def test_a_stated_or_given_unit_counts() -> None:
    assert conclude_length_unit(POSITIONS_M, TIMES_S, "ft", None)[1] == 0.3048
    assert conclude_length_unit(POSITIONS_M, TIMES_S, "ft", 0.5)[1] == 0.5


@pytest.mark.parametrize("order", ["wxyz", "xyzw"])
def test_a_lever_arm_shows_the_order(order: str) -> None:
    quaternions = QUATERNIONS if order == "wxyz" else QUATERNIONS[:, XYZW]
    found = conclude_quaternion_order(POSITIONS_M, quaternions, TIMES_S, stated="", reason="", given=None, usual="xyzw")
    assert (found.value, found.assumed) == (order, False)
    doubted = conclude_quaternion_order(
        POSITIONS_M, quaternions, TIMES_S, stated="wxyz", reason="the header's names", given=None, usual=""
    )
    assert doubted.value == "wxyz"
    assert ("but in the order xyzw a lever arm explains" in doubted.reason) == (order == "xyzw")


def test_movement_without_a_lever_arm_shows_no_order(rng: np.random.Generator) -> None:
    places = np.cumsum(rng.normal(size=POSITIONS_M.shape), axis=0)
    found = conclude_quaternion_order(places, QUATERNIONS, TIMES_S, stated="", reason="", given=None, usual="wxyz")
    assert (found.value, found.assumed) == ("wxyz", True)


def test_the_share_that_a_lever_arm_explains(rng: np.random.Generator) -> None:
    assert explained_by_lever_arm(POSITIONS_M, QUATERNIONS, TIMES_S) == pytest.approx(1.0)
    assert explained_by_lever_arm(np.zeros_like(POSITIONS_M), QUATERNIONS, TIMES_S) == 0.0
    assert explained_by_lever_arm(POSITIONS_M[:9], QUATERNIONS[:9], TIMES_S[:9]) == 0.0
    turned = rotations.multiply(QUATERNIONS, rotations.exp(np.array([0.3, -1.0, 0.4])))  # another frame on the body
    assert explained_by_lever_arm(POSITIONS_M, turned, TIMES_S) == pytest.approx(1.0)
