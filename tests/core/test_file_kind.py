"""What a file is, told by its content."""

import os
from pathlib import Path

import pytest

from harness.core.file_kind import check_toml_kind, file_kind, toml_kind, wrong_file
from harness.errors import BadFile
from harness.stream.recording import FILE_HEADER
from tests.verb_examples import unpack_files

KINDS = {
    "small.toml": "a scenario",
    "sweep.toml": "a sweep",
    "place.toml": "a placement study",
    "plan.toml": "a trust plan",
    "poses.toml": "a calibration",
    "tpose.toml": "a calibration",
    "unit.toml": "a unit file",
    "walking.rec": "a recording",
    "constellation.mcf": "a list of emitters",
    "run/summary.json": "a file of results",
    "run/index.sqlite": "a file of results",
    "table.csv": "",
    "run": "",
    "no_such_file": "",
}


def test_files_of_each_kind(tmp_path: Path) -> None:
    unpack_files(tmp_path)
    assert {name: file_kind(tmp_path / name) for name in KINDS} == KINDS


def test_a_damaged_file_of_results_is_none(tmp_path: Path) -> None:
    path = tmp_path / "cell.json"
    path.write_text('{"schema": 1')
    assert file_kind(path) == ""
    path.write_text('{"schema": 1}')
    assert file_kind(path) == "a file of results"


@pytest.mark.parametrize(
    ("content", "kind"),
    [
        (b"", "an empty file"),
        (b"\x00\xff", "binary data"),
        (b"SQLite format 3\x00\nCREATE TABLE messages(id)", "an SQLite database"),
        (FILE_HEADER, "a recording"),
        (FILE_HEADER[:8] + b"\2\0\0\0", "a recording of poses"),
        (b"\nHIERARCHY\nROOT hip", "a BVH motion"),
        (b"hello", ""),
        (b"# Stra\xdfe\nmotion = 1", ""),
        (b'kind = ["unit"]', ""),
        (b"[motion]\r\n", "a scenario"),
    ],
)
def test_contents(content: bytes, kind: str, tmp_path: Path) -> None:
    path = tmp_path / "file"
    path.write_bytes(content)
    assert file_kind(path) == kind


def test_a_fifo_is_not_waited_for(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "fifo")
    assert file_kind(tmp_path / "fifo") == ""


def test_a_damaged_file_of_the_expected_kind_keeps_its_own_message(tmp_path: Path) -> None:
    path = tmp_path / "a.rec"
    path.write_bytes(FILE_HEADER[:-1])
    assert str(wrong_file(path, "no block", "a recording", "Record again.")) == (
        f"{path}: no block; expected a recording. Record again."
    )
    assert str(wrong_file(path, "no block", "a scenario", "Copy it.")) == (
        f"{path}: a recording; expected a scenario. `harness replay` and `harness view` read it."
    )


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ({"kind": "trust plan"}, ""),
        ({"kind": "placement"}, "p: a placement study; expected a trust plan. `harness placement` runs it."),
        ({}, 'p: no key `kind`; expected a trust plan, kind = "trust plan". See there.'),
        ({"kind": "trust"}, "p: kind = 'trust'; expected a trust plan, kind = \"trust plan\". See there."),
    ],
)
def test_a_toml_file_of_another_kind(content: dict[str, str], told: str) -> None:
    def check() -> None:
        check_toml_kind(Path("p"), content, "a trust plan", "See there.", needs_kind="trust plan")

    if not told:
        return check()
    with pytest.raises(BadFile) as refused:
        check()
    assert str(refused.value) == told
    return None


def test_a_file_without_a_kind_is_left_to_its_reader() -> None:
    assert toml_kind({"kind": "n", "motion": 1}) == "a scenario"
    check_toml_kind(Path("p"), {}, "a scenario", "See there.")
