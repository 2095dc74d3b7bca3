"""Calibration files: every digit is read back, and impossible content is refused."""

import os
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.calibrate.calibration_file import CalibrationFile, read_calibration, write_calibration
from harness.core.calibration import Calibration
from harness.core.humanoid24 import BONES, standard_skeleton
from harness.errors import BadFile, BadInput
from tests.core.digested_toml import as_earlier_version, declare_edited


def kept(
    rng: np.random.Generator, stations: tuple[str, ...] = ("head", "left wrist"), **diagnostics: Any
) -> CalibrationFile:
    turn = rng.normal(size=(len(stations) + 1, 4))
    turn /= np.linalg.norm(turn, axis=1, keepdims=True)
    calibration = Calibration(
        kind="poses",
        stations=stations,
        bones=tuple(rng.choice(BONES, len(stations))),
        mount_m=0.1 * rng.normal(size=(len(stations), 3)),
        bone_from_station=turn[1:],
        world_from_tracker=turn[0],
        tracker_origin_m=3.0 * rng.normal(size=3),
    )
    standard = standard_skeleton()
    return CalibrationFile(
        calibration, standard.with_bones(standard.bone_m * rng.uniform(0.8, 1.2, (24, 3))), diagnostics
    )


def same(one: CalibrationFile, other: CalibrationFile) -> bool:
    """Whether two calibrations are equal bit for bit."""
    a, b = one.calibration, other.calibration
    arrays = ("mount_m", "bone_from_station", "world_from_tracker", "tracker_origin_m")
    assert (one.skeleton is None) == (other.skeleton is None)
    bones = one.skeleton is None or other.skeleton is None or np.array_equal(one.skeleton.bone_m, other.skeleton.bone_m)
    names = (a.kind, a.stations, a.bones, dict(one.diagnostics)) == (
        b.kind,
        b.stations,
        b.bones,
        dict(other.diagnostics),
    )
    return (
        names
        and bones
        and one.performer == other.performer
        and all(np.array_equal(getattr(a, name), getattr(b, name)) for name in arrays)
    )


def test_every_digit_comes_back(tmp_path: Path, rng: np.random.Generator) -> None:
    for number in range(20):
        one = kept(rng, made="2026-01-02", lengths={"ltibia": {"sd_m": float(rng.normal()), "from_prior": True}}, n=3)
        if number % 2:
            one = replace(one, skeleton=None, performer='13 "A"')
        write_calibration(tmp_path / f"{number}.toml", one)
        assert same(read_calibration(tmp_path / f"{number}.toml"), one)


words = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
values = st.one_of(st.booleans(), st.integers(-(2**62), 2**62), st.floats(allow_nan=False), words)
tables = st.recursive(
    st.dictionaries(words, values | st.lists(values, max_size=3), max_size=3),
    lambda inner: st.dictionaries(words, inner | values, max_size=3),
    max_leaves=6,
)


@settings(max_examples=50, deadline=None)
@given(stations=st.lists(words, min_size=1, max_size=3, unique=True), diagnostics=tables)
def test_any_words_come_back(
    tmp_path_factory: pytest.TempPathFactory, stations: list[str], diagnostics: dict[str, Any]
) -> None:
    path = tmp_path_factory.mktemp("words") / "a.toml"
    one = kept(np.random.default_rng(1), tuple(stations), **{f"_{key}": value for key, value in diagnostics.items()})
    write_calibration(path, one)
    assert same(read_calibration(path), one)


def test_a_file_is_there_whole_or_not_at_all(
    tmp_path: Path, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, one, two = tmp_path / "a.toml", kept(rng), kept(rng)
    write_calibration(path, one)
    with pytest.raises(BadFile, match="it exists"):
        write_calibration(path, two)
    assert same(read_calibration(path), one)

    def full(*names: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OSError, match="No space left"):
        write_calibration(path, two, force=True)
    assert same(read_calibration(path), one)
    assert list(tmp_path.iterdir()) == [path]
    monkeypatch.undo()
    write_calibration(path, two, force=True)
    assert same(read_calibration(path), two)


def test_what_a_link_points_to_is_replaced(tmp_path: Path, rng: np.random.Generator) -> None:
    one, link = kept(rng), tmp_path / "link.toml"
    (tmp_path / "a.toml").write_text("old")
    link.symlink_to(tmp_path / "a.toml")
    write_calibration(link, one, force=True)
    assert link.is_symlink()
    assert same(read_calibration(tmp_path / "a.toml"), one)


def test_no_place_for_it(tmp_path: Path, rng: np.random.Generator) -> None:
    with pytest.raises(BadFile, match="it is not a file"):
        write_calibration(tmp_path, kept(rng), force=True)
    (tmp_path / "file").write_text("")
    with pytest.raises(BadFile):
        write_calibration(tmp_path / "file" / "a.toml", kept(rng))
    write_calibration(tmp_path / "there" / "a.toml", one := kept(rng))  # its folder is made
    assert same(read_calibration(tmp_path / "there" / "a.toml"), one)
    with pytest.raises(BadFile, match="no such file"):
        read_calibration(tmp_path / "b.toml")


def without(key: str) -> Callable[[str], str]:
    return lambda text: "\n".join(line for line in text.split("\n") if not line.startswith(f"{key} ="))


def line(key: str, value: str) -> Callable[[str], str]:
    """Replaces the first line with this key."""

    def change(text: str) -> str:
        lines = text.split("\n")
        at = next(n for n, one in enumerate(lines) if one.startswith(f"{key} ="))
        return "\n".join([*lines[:at], f"{key} = {value}", *lines[at + 1 :]])

    return change


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (line("schema", "3"), "schema 3; expected a calibration of schema 2"),
        (line("schema", '"1"'), "schema '1'; expected a calibration of schema 2"),
        (line("schema", "true"), "schema True; expected a calibration of schema 2"),
        (without("schema"), "no schema; expected a calibration of schema 2"),
        (lambda text: text + "[", "not TOML"),
        (lambda text: text.replace("mount_m", "mont_m"), "Did you mean 'mount_m'"),
        (lambda text: text.replace("[room]", "[rom]"), "Did you mean 'room'"),
        (without("bone_from_station"), "missing bone_from_station"),
        (lambda text: text.replace("[diagnostics]", "[told]"), "the key 'told' is now called 'diagnostics'"),
        (line("mount_m", "[0.1, 0.2]"), "mount_m: expected 3 values, found 2"),
        (line("mount_m", "[0.1, 0.2, nan]"), "mount_m[2]: expected a finite number"),
        (line("mount_m", "[0.1, 0.2, 30.0]"), "mount_m is more than 1 m from its bone"),
        (line("mount_m", '[0.1, 0.2, "0"]'), "mount_m[2]: expected a number"),
        (line("bone_from_station", "[1.0, 0.1, 0.0, 0.0]"), "not a unit quaternion: its length is 1.00499"),
        (line("bone_from_station", "[1.0000015, 0.0, 0.0, 0.0]"), "not a unit quaternion: its length is 1"),
        (line("world_from_tracker", "[0.0, 0.0, 0.0, 0.0]"), "room.world_from_tracker is not a unit quaternion"),
        (line("bone", '"nose"'), "'nose' is not one of the bones"),
        (line("kind", "1"), "kind: expected a text"),
        (line("ltibia", "[0.0, 0.0, -40.0]"), "bone_m.ltibia is 40 m long"),
        (line("ltibia", "[0.0, 0.0, 0.0]"), "bone_m.ltibia is 0 m long"),
        (without("ltibia"), "ltibia: missing"),
        (lambda text: text.replace("ltibia", "ltail"), "ltail, ltibia: missing, or not one of"),
        (lambda text: text[: text.index("[station")] + "[station]\n", "no stations"),
        (lambda text: "\x00" + text, "binary data"),
    ],
)
def test_what_cannot_be_true_is_refused(
    tmp_path: Path, rng: np.random.Generator, change: Callable[[str], str], says: str
) -> None:
    path = tmp_path / "a.toml"
    write_calibration(path, kept(rng))
    before = declare_edited(path.read_text(encoding="utf-8"))
    path.write_text(change(before), encoding="utf-8")
    assert path.read_text(encoding="utf-8") != before
    with pytest.raises(BadFile) as caught:
        read_calibration(path)
    assert says in str(caught.value)
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


def test_every_lost_line_and_every_cut_is_noticed(tmp_path: Path, rng: np.random.Generator) -> None:
    path = tmp_path / "a.toml"
    write_calibration(path, kept(rng, made="today", stations_sd={"head": 1.0}))
    whole = path.read_bytes()
    lines = whole.splitlines(keepends=True)
    changed = [b"".join(lines[:n] + lines[n + 1 :]) for n in range(len(lines))]
    changed += [b"".join(lines[:n]) for n in range(len(lines))] + [
        whole[:-2],
        whole + b"\n",
        whole.replace(b"0.", b"1.", 1),
    ]
    assert len(changed) > 80
    for content in changed:
        path.write_bytes(content)
        with pytest.raises(BadFile) as caught:
            read_calibration(path)
        assert "\n" not in str(caught.value)
    path.write_bytes(whole.replace(b"\n", b"\r\n"))
    assert read_calibration(path).caveat == ""  # as a checkout on Windows has it


def test_an_edit_that_is_declared_is_read_with_a_caveat(tmp_path: Path, rng: np.random.Generator) -> None:
    path = tmp_path / "a.toml"
    write_calibration(path, kept(rng))
    change = line("ltibia", "[0.0, 0.0, -0.4]")
    path.write_text(change(path.read_text(encoding="utf-8")), encoding="utf-8")
    with pytest.raises(BadFile, match=r'does not fit its digest.*its first line is sha256 = "edited"'):
        read_calibration(path)
    path.write_text(declare_edited(path.read_text(encoding="utf-8")), encoding="utf-8")
    found = read_calibration(path)
    assert found.skeleton is not None
    assert found.skeleton.bone_m[BONES.index("ltibia"), 2] == -0.4
    assert "edited by hand" in found.caveat


def test_a_file_of_an_earlier_version_has_to_be_whole(tmp_path: Path, rng: np.random.Generator) -> None:
    path = tmp_path / "a.toml"
    listed = {"stations": {"head": {"sd_m": 0.01}, "left wrist": {"sd_m": 0.01}}}
    write_calibration(path, replace(kept(rng), diagnostics=listed))
    text = as_earlier_version(path)
    path.write_text(text, encoding="utf-8")
    assert "without a digest" in read_calibration(path).caveat
    without_head = text[: text.index("[station.head]")] + text[text.index('[station."left wrist"]') :]
    without_bones = text[: text.index("[bone_m]")] + text[text.index("[diagnostics") :]
    for content, lost in (
        (text[: text.index("[bone_m]")], "[bone_m]"),
        (text[: text.index("[diagnostics")], "[diagnostics]"),
        (without_head, "[station.head]"),
        (without_bones, "[bone_m]"),
    ):
        path.write_text(content, encoding="utf-8")
        with pytest.raises(BadFile, match=f"damaged: no {re.escape(lost)}"):
            read_calibration(path)


def test_stations_are_found_by_name(rng: np.random.Generator) -> None:
    one = kept(rng, ("head", "torso", "left_wrist"))
    two = one.select(["left_wrist", "head"])
    assert two.calibration.stations == ("left_wrist", "head")
    assert two.calibration.bones == (one.calibration.bones[2], one.calibration.bones[0])
    np.testing.assert_array_equal(two.calibration.mount_m, one.calibration.mount_m[[2, 0]])
    np.testing.assert_array_equal(two.calibration.bone_from_station, one.calibration.bone_from_station[[2, 0]])
    assert two.skeleton is one.skeleton
    assert same(one.select(one.calibration.stations), one)
    with pytest.raises(BadInput, match="Station 'pelvis' is not in the calibration, which has head, torso, left_wrist"):
        one.select(["head", "pelvis"])


def test_what_toml_has_no_word_for_is_not_written(tmp_path: Path, rng: np.random.Generator) -> None:
    with pytest.raises(TypeError, match="not TOML serializable"):
        write_calibration(tmp_path / "a.toml", kept(rng, made=None))
    assert not list(tmp_path.iterdir())
    standard = standard_skeleton()
    tilted = replace(standard, axes=standard.axes[::-1])
    with pytest.raises(BadInput, match="other joints"):
        write_calibration(tmp_path / "a.toml", replace(kept(rng), skeleton=tilted))
