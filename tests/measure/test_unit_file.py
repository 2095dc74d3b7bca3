"""Unit files: read back as written, damaged ones refused in one line."""

import re
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.core.number_format import Interval
from harness.errors import BadFile
from harness.measure.unit_file import UnitFile, read_unit_file, write_unit_file
from tests.core.digested_toml import as_earlier_version, declare_edited

UNIT = UnitFile(
    name="lab unit",
    components={"white": {"position_m": 0.0007}, "echo": {"share": 0.03, "size_m": [0.05, 0.3]}},
    tracker={"rate_hz": 40.0, "items": [40, 2, 11, 21, 1]},
    measured={"components.white.position_m": Interval(0.0007, 0.00069, 0.00071, 1000)},
    not_measured={"components.session.scale": "A reference is needed."},
    session={"scale": Interval(0.001, 0.0, 0.002, 6)},
    capture={"file": 'a "quoted" name.is900', "seconds": 60.0},
)


def test_a_unit_file_reads_back_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / "unit.toml"
    write_unit_file(path, UNIT)
    assert read_unit_file(path) == UNIT
    before = path.read_bytes()
    write_unit_file(path, UNIT, force=True)
    assert path.read_bytes() == before


def test_an_existing_file_is_not_replaced_unasked(tmp_path: Path) -> None:
    path = tmp_path / "unit.toml"
    path.write_text("mine")
    with pytest.raises(BadFile, match="it exists"):
        write_unit_file(path, UNIT)
    assert path.read_text() == "mine"


def test_a_key_that_was_not_measured_has_no_interval(tmp_path: Path) -> None:
    path = tmp_path / "unit.toml"
    write_unit_file(path, replace(UNIT, measured={"components.echo.share": Interval.missing("no static stretch")}))
    assert read_unit_file(path).measured == {}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('kind = "unit"', 'kind = "run"', "kind = 'run'"),
        ("schema = 2", "schema = 3", "schema 3"),
        ("[tracker]", "[trackers]", "trackers"),
        ("0.00069, 0.00071, 1000]", "0.00072, 0.00071, 1000]", "interval"),
        ("0.00069, 0.00071, 1000]", "0.00069]", "expected 4 values"),
        ("scale = [0.001, 0.0, 0.002, 6]", "scale = [-2.0007, -2.0008, -2.0006, 6]", "left-handed"),
        ("scale = [0.001, 0.0, 0.002, 6]", "scale = [-0.6952, -0.6953, -0.6951, 6]", "feet"),
        ("[components.white]", "[components]\nwhite = 3.0\n[components.other]", "components.white: expected a table"),
    ],
)
def test_a_file_that_is_no_unit_file_is_refused(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = tmp_path / "unit.toml"
    write_unit_file(path, UNIT)
    text = path.read_text()
    assert old in text
    path.write_text(declare_edited(text.replace(old, new)))
    with pytest.raises(BadFile, match=message):
        read_unit_file(path)


def test_every_lost_line_and_every_cut_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "unit.toml"
    write_unit_file(path, UNIT)
    lines = path.read_bytes().splitlines(keepends=True)
    for n in range(len(lines)):
        for content in (lines[:n] + lines[n + 1 :], lines[:n]):
            path.write_bytes(b"".join(content))
            with pytest.raises(BadFile):
                read_unit_file(path)
    text = b"".join(lines).decode().replace("position_m = 0.0007", "position_m = 0.0009")
    path.write_text(text)
    with pytest.raises(BadFile, match="does not fit its digest"):
        read_unit_file(path)
    path.write_text(declare_edited(text))
    edited = read_unit_file(path)
    assert edited.components["white"]["position_m"] == 0.0009
    assert "edited by hand" in edited.caveat


def test_a_file_of_an_earlier_version_has_to_be_whole(tmp_path: Path) -> None:
    """Every key of [measured] and [not_measured] has its value, and the last table is there."""
    path = tmp_path / "unit.toml"
    components = {**UNIT.components, "session": {"scale": 0.001}}
    measured = {**UNIT.measured, "components.echo.size_m": Interval(0.2, 0.1, 0.3, 20)}
    write_unit_file(path, replace(UNIT, components=components, measured=measured))
    text = as_earlier_version(path)
    path.write_text(text)
    unit = read_unit_file(path)
    assert (unit.schema, "without a digest" in unit.caveat) == (1, True)
    for line, lost in (
        ("position_m = 0.0007\n", "components.white.position_m"),
        ("scale = 0.001\n", "components.session.scale"),
        ("size_m = [0.05, 0.3]\n", "components.echo.size_m"),
        ("rate_hz = 40.0\n", "tracker.rate_hz"),
        (text[text.index("[capture]") :], "[capture]"),
    ):
        assert line in text
        path.write_text(text.replace(line, "", 1))
        with pytest.raises(BadFile, match=f"damaged: no {re.escape(lost)}"):
            read_unit_file(path)


@given(data=st.data())
def test_a_damaged_file_is_read_or_refused(data: st.DataObject, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("unit") / "unit.toml"
    write_unit_file(path, UNIT)
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    path.write_bytes(bytes(content[: data.draw(st.integers(0, len(content)))]))
    with suppress(BadFile):  # any other error fails the test
        read_unit_file(path)
