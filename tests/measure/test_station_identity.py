"""Exchanged stations are found by their angular speeds; sound ones never change."""

from collections.abc import Mapping

import numpy as np
import pytest

from harness.core import rotations
from harness.core.arrays import Floats
from harness.measure.pose_series import MeasuredPoses, TruthPoses
from harness.measure.station_identity import identify_stations

NAMES = ("a", "b", "c")


def turning(name: str, time_s: Floats) -> Floats:
    """Orientations (N, 4) of a body that turns at its own frequencies."""
    rates = np.array([1.3, 0.9, 2.1]) * {"a": 1.0, "b": 1.7, "c": 0.6, "d": 2.3}[name]
    return rotations.exp(0.8 * np.sin(time_s[:, None] * rates))


def bodies(names: tuple[str, ...] = NAMES) -> dict[str, TruthPoses]:
    time_s = np.arange(4000) / 100.0
    return {name: TruthPoses(time_s, np.zeros((4000, 3)), turning(name, time_s)) for name in names}


def stations(carried: Mapping[str, str], rng: np.random.Generator, noise_rad: float = 1e-3) -> dict[str, MeasuredPoses]:
    """Stations that are worn on these bodies at any angle, in a room that is turned, and a clock that is 1.5 s late."""
    time_s, out = np.arange(1600) / 40.0, {}
    for station, body in carried.items():
        mount, room = (rotations.exp(rng.normal(size=3)) for _ in range(2))
        turn = rotations.multiply(room, rotations.multiply(turning(body, time_s), mount))
        noisy = rotations.multiply(turn, rotations.exp(noise_rad * rng.normal(size=(1600, 3))))
        valid = rng.random(1600) > 0.02
        place = np.zeros((1600, 3))
        out[station] = MeasuredPoses(time_s + 1.5, place, np.where(valid[:, None], noisy, np.nan), valid)
    return out


@pytest.mark.parametrize("carried", ["abc", "bac", "bca", "cba"])
def test_the_bodies_are_those_that_turn_as_the_stations_do(carried: str, rng: np.random.Generator) -> None:
    worn = dict(zip(NAMES, carried, strict=True))
    assert identify_stations(stations(worn, rng), bodies(), dict(zip(NAMES, NAMES, strict=True))) == worn


def test_bodies_without_a_station_are_not_considered(rng: np.random.Generator) -> None:
    """Station c is on d, of which nobody said that it carries a station: it stays where it is said to be."""
    stated = dict(zip(NAMES, NAMES, strict=True))
    found = identify_stations(stations(stated | {"c": "d"}, rng), bodies(("a", "b", "c", "d")), stated)
    assert found == stated


def test_two_stations_on_one_body_are_left_alone(rng: np.random.Generator) -> None:
    stated = {"a": "a", "b": "a"}
    assert identify_stations(stations(stated, rng), bodies(), stated) == stated


def test_one_station_is_where_it_is_said_to_be(rng: np.random.Generator) -> None:
    assert identify_stations(stations({"a": "b"}, rng), bodies(), {"a": "a"}) == {"a": "a"}


def test_noise_exchanges_nothing(rng: np.random.Generator) -> None:
    """Two bodies that turn alike cannot be told apart, and are left as stated."""
    alike = bodies()
    alike["b"] = alike["a"]
    stated = dict(zip(NAMES, NAMES, strict=True))
    for _ in range(5):
        assert identify_stations(stations(stated | {"b": "a"}, rng, noise_rad=0.02), alike, stated) == stated
