"""The constellation: shipped files, scenarios' files, survey errors, and what is refused."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.core.fields import build
from harness.errors import BadFile, BadInput, UnknownName
from harness.simulate.physics.constellation import (
    Constellation,
    ConstellationSettings,
    check_reach,
    constellation_path,
    load_constellation,
    middle_of_path_m,
)
from harness.simulate.physics.emitters import read_mcf
from harness.stream.polhemus import DEFAULT_EMITTERS
from harness.stream.polhemus.codec import Emitter
from tests.simulate.physics.rooms import write_mcf

DOWN = (0.0, 0.0, 1.0)


def three(**changes: Any) -> list[Emitter]:
    emitters = [Emitter(n, (float(n), 0.5 * n * n, 0.0), DOWN, 5000 + n) for n in (1, 2, 3)]
    return [*emitters[:2], replace(emitters[2], **changes)]


def test_cave_has_the_emitters_of_the_emulator() -> None:
    cave = load_constellation(ConstellationSettings(name="cave"))
    assert cave.emitters == DEFAULT_EMITTERS
    assert (cave.cone_rad, cave.range_m) == (np.deg2rad(70.0), 4.0)


def test_hall_is_twelve_bars_of_three_that_face_down() -> None:
    hall = load_constellation(ConstellationSettings(name="hall"))
    assert len(hall) == 36
    np.testing.assert_array_equal(hall.normal, np.tile(DOWN, (36, 1)))
    by_bar = np.argsort(hall.identity)
    assert not np.any(np.abs(np.diff(by_bar)) == 1), "the turn jumps from bar to bar"
    steps_m = np.diff(hall.position_m[by_bar].reshape(12, 3, 3), axis=1)
    along = np.array([0.9144 * np.roll([1.0, 0.0, 0.0], (row + place) % 2) for row in range(3) for place in range(4)])
    np.testing.assert_allclose(steps_m, np.repeat(along[:, None], 2, axis=1), atol=1e-9)
    np.testing.assert_allclose(hall.position_m.mean(axis=0), 0.0, atol=1e-9)


@pytest.mark.parametrize(("name", "heights_m"), [("real_cave", (2.44, 2.59)), ("real_walls", (0.07, 2.98))])
def test_the_bars_of_real_rooms_are_the_maker_s_and_face_the_performer(
    name: str, heights_m: tuple[float, float]
) -> None:
    """Bars of three emitters, 0.91 m apart (docs/is900.md 13.1)."""
    room = load_constellation(ConstellationSettings(name=name))
    height_m = 2.5 - room.position_m[:, 2]
    assert heights_m[0] < height_m.min() < height_m.max() < heights_m[1]
    steps_m = np.linalg.norm(np.diff(room.position_m.reshape(6, 3, 3), axis=1), axis=-1)
    np.testing.assert_allclose(steps_m, 0.91, atol=0.02)
    towards = np.array([0.0, 0.0, 1.0]) - room.position_m
    assert np.all(np.sum(towards * room.normal, axis=1) > 0.3)


@pytest.mark.parametrize("name", ["cave", "hall"])
def test_the_lines_of_a_shipped_constellation_are_its_file(name: str, tmp_path: Path) -> None:
    emitters = load_constellation(ConstellationSettings(name=name)).emitters
    path = write_mcf(tmp_path, emitters)
    assert read_mcf(path) == emitters
    assert constellation_path(name).read_bytes() == b"# %d emitters\r\n" % len(emitters) + path.read_bytes()


def test_an_unknown_name_is_refused() -> None:
    with pytest.raises(UnknownName, match="Did you mean 'hall'"):
        load_constellation(ConstellationSettings(name="halll"))


def test_rounded_normals_become_unit_vectors() -> None:
    emitters = three(normal=(0.71, 0.0, 0.71))
    constellation = Constellation.of_emitters(emitters, 1.0, 4.0)
    np.testing.assert_allclose(np.linalg.norm(constellation.normal, axis=1), 1.0, atol=1e-15)
    np.testing.assert_allclose(constellation.normal[2], [0.5**0.5, 0.0, 0.5**0.5], atol=1e-15)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"normal": (0.0, 0.0, 0.99)}, "of length 0.990"),
        ({"normal": (0.0, float("nan"), 1.0)}, "unit"),
        ({"position_m": (0.0, float("inf"), 1.0)}, "coordinates"),
        ({"position_m": (1.0, 0.5, 0.0009)}, "at the place of emitter 1"),
        ({"number": 1}, "a second emitter 1"),
        ({"number": -1}, "a number from 1"),
        ({"identity": -1}, "an identity from 0"),
    ],
)
def test_bad_emitters_are_refused(changes: dict[str, Any], said: str) -> None:
    for refuse in (
        lambda: Constellation.of_emitters(three(**changes), 1.0, 4.0),
        lambda: ConstellationSettings(emitters=tuple(three(**changes))),
    ):
        with pytest.raises(BadInput, match=said):
            refuse()
    with pytest.raises(BadInput, match="2 emitters"):
        Constellation.of_emitters(three()[:2], 1.0, 4.0)


def test_emitters_two_millimetres_apart_are_accepted() -> None:
    assert len(Constellation.of_emitters(three(position_m=(1.0, 0.5, 0.002)), 1.0, 4.0)) == 3


@pytest.mark.parametrize(
    "change",
    [
        {"cone_rad": 0.0},
        {"cone_rad": 1.6},
        {"cone_rad": float("nan")},
        {"range_m": -1.0},
        {"range_m": float("nan")},
        {"position_m": np.full((3, 3), np.nan)},
        {"normal": np.full((3, 3), 0.5)},
    ],
)
def test_a_constellation_without_sense_is_refused(change: dict[str, Any]) -> None:
    with pytest.raises(BadInput):
        replace(Constellation.of_emitters(three(), 1.0, 4.0), **change)


def test_shifting_moves_every_emitter() -> None:
    cave = load_constellation(ConstellationSettings(name="cave"))
    moved = cave.translate(np.array([1.0, -2.0, 0.5]))
    np.testing.assert_allclose(moved.position_m - cave.position_m, np.tile([1.0, -2.0, 0.5], (9, 1)), atol=1e-12)
    np.testing.assert_array_equal(moved.normal, cave.normal)


def test_each_emitter_has_its_own_survey_error() -> None:
    hall = load_constellation(ConstellationSettings(name="hall"))
    true = hall.with_survey_error(0.01, 7, "morning")
    error_m = true.position_m - hall.position_m
    assert 0.007 < np.std(error_m) < 0.013
    fewer = Constellation.of_emitters(hall.emitters[5:], hall.cone_rad, hall.range_m).with_survey_error(
        0.01, 7, "morning"
    )
    np.testing.assert_array_equal(fewer.position_m, true.position_m[5:])
    np.testing.assert_array_equal(hall.with_survey_error(0.0, 7, "morning").position_m, hall.position_m)
    assert np.all(hall.with_survey_error(0.01, 7, "evening").position_m != true.position_m)
    assert np.all(hall.with_survey_error(0.01, 8, "morning").position_m != true.position_m)


def test_a_scenario_names_a_file_in_its_folder(tmp_path: Path) -> None:
    (tmp_path / "scenario" / "rooms").mkdir(parents=True)
    outside = write_mcf(tmp_path, three())
    write_mcf(tmp_path / "scenario" / "rooms", three())
    named = ConstellationSettings(name="no such name", file="rooms/room.mcf")
    with pytest.raises(BadInput, match="has not been read"):
        load_constellation(named)
    read = named.with_file_read(tmp_path / "scenario")
    assert load_constellation(read).emitters == tuple(three())
    (tmp_path / "scenario" / "link.mcf").symlink_to(outside)
    for file in ("../room.mcf", str(outside), "link.mcf"):
        with pytest.raises(BadFile, match="outside the scenario's folder"):
            ConstellationSettings(file=file).with_file_read(tmp_path / "scenario")
    with pytest.raises(BadFile, match="no such file"):
        ConstellationSettings(file="c.mcf").with_file_read(tmp_path / "scenario")
    assert ConstellationSettings().with_file_read(tmp_path).emitters == ()


def test_emitters_can_stand_in_the_scenario_itself() -> None:
    table = [{"number": n, "position_m": [n, n * n, 0.0], "normal": list(DOWN), "identity": 1} for n in (1, 2, 3)]
    settings = build(ConstellationSettings, {"emitters": table}, "constellation")
    assert len(load_constellation(settings)) == 3


def test_reach_is_range_and_cone() -> None:
    cave = load_constellation(ConstellationSettings(name="cave"))
    check_reach(cave, np.array([[50.0, 0.0, 1.0], [0.0, 0.0, 3.9]]))
    for far_m in ([0.0, 0.0, 4.1], [0.0, 0.0, -1.0], [3.5, 0.0, 0.5], [0.0, 60.0, 1.0]):
        with pytest.raises(BadInput, match="No station is within reach"):
            check_reach(cave, np.array([far_m]))


def test_the_middle_of_a_path_is_that_of_its_rectangle() -> None:
    path = np.array([[0.0, 1.0, 0.9], [0.1, 1.0, 0.9], [4.0, -2.0, 0.9], [0.0, 0.0, 0.9]])
    np.testing.assert_allclose(middle_of_path_m(path), [2.0, -0.5])
