"""`harness validate` as a user meets it."""

import csv
from pathlib import Path

import pytest

from harness.cli import main
from harness.measure import read_unit_file
from tests.command import Command

pytestmark = pytest.mark.long
CLIP = "boxing_p1_01"


@pytest.fixture(scope="module")
def boxing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("validate") / "boxing.rec"
    assert main(["record", "sim:builtin_boxing", str(path), "--clip", CLIP, "--noise", "default"]) == 0
    return path


def test_a_capture_is_validated_against_its_clip(boxing: Path, tmp_path: Path, command: Command) -> None:
    before, unit = boxing.read_bytes(), tmp_path / "unit.toml"
    said = command("validate", boxing, "--truth", CLIP, "--out", unit, "--methods", "ik")
    assert said.lines[-1] == "pass"
    for words in (
        "no departure",
        "time offset by orientation",
        "room and mounts",
        "left_hand on lhand",
        "reconstruction",
    ):
        assert words in said.out
    assert boxing.read_bytes() == before
    assert set(read_unit_file(unit).session) == {"scale", "heading_rad", "latency_s"}
    assert "left_hand on lhand" in unit.with_suffix(".html").read_text(encoding="utf-8")
    assert "--force" in command("validate", boxing, "--truth", CLIP, "--out", unit, code=2).err
    command("validate", boxing, "--truth", CLIP, "--out", unit, "--expect", unit, "--force")


def test_a_method_that_fails_leaves_the_validation_and_is_named(
    boxing: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    upright = Path(__file__).parents[1] / "testing" / "upright.py"
    (tmp_path / "diverging.py").write_text(
        upright.read_text().replace(
            "def begin(", "def begin(self, _): raise OverflowError('diverged')\n\n    def unused("
        )
    )
    monkeypatch.syspath_prepend(tmp_path)
    words = ("validate", boxing, "--truth", CLIP, "--methods", "diverging:Upright", "--out", tmp_path / "unit.toml")
    said = command(*words, code=4)
    assert said.lines[-1] == "incomplete"
    assert "failed: diverging:Upright: OverflowError: diverged" in said.out
    assert read_unit_file(tmp_path / "unit.toml").session


def test_json_holds_every_number_with_its_interval(boxing: Path, command: Command) -> None:
    content = command("validate", boxing, "--truth", CLIP, "--json").content
    assert content["outcome"] == "pass"
    ahead = content["numbers"]["components.speed.ahead_s"]
    assert ahead["low"] < ahead["value"] < ahead["high"]
    assert content["matched_share"] > 0.97
    assert (content["departures"], content["exchanged"], content["damage"]) == ([], {}, [])


def test_the_frames_of_replay_are_a_reference(boxing: Path, tmp_path: Path, command: Command) -> None:
    path = tmp_path / "frames.csv"
    path.write_text(command("replay", boxing, "--frames").out, encoding="utf-8")
    numbers = command("validate", boxing, "--truth", path, "--json").content["numbers"]
    assert abs(numbers["time_offset_orientation_s"]["value"]) < 1e-6


@pytest.mark.parametrize(("sign", "factor", "cause"), [(-1.0, 1.0, "left-handed"), (1.0, 1.0 / 0.3048, "feet")])
def test_a_mirrored_reference_and_one_in_feet_write_no_file(
    sign: float, factor: float, cause: str, boxing: Path, tmp_path: Path, command: Command
) -> None:
    table = command("replay", boxing, "--frames").lines[:-1]
    path, unit = tmp_path / "frames.csv", tmp_path / "out" / "unit.toml"
    unit.parent.mkdir()
    rows = list(csv.DictReader(table))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        for row in rows:
            signs = {"x_m": factor, "y_m": sign * factor, "z_m": factor, "qx": sign, "qz": sign}
            writer.writerow(row | {key: by * float(row[key]) for key, by in signs.items() if row[key]})
    said = command("validate", boxing, "--truth", path, "--out", unit, "--json", code=2)
    assert (cause in said.err, said.content["outcome"]) == (True, "refused")
    assert list(unit.parent.iterdir()) == []


def test_methods_need_a_clip(boxing: Path, command: Command) -> None:
    said = command("validate", boxing, "--truth", boxing, "--methods", "ik", code=2)
    assert said.out == "refused\n"
    assert "Only a clip has a performer's body" in said.err


def test_a_short_capture_is_not_comparable(tmp_path: Path, command: Command) -> None:
    path = tmp_path / "short.rec"
    command("record", "sim:builtin_boxing", path, "--clip", CLIP, "--seconds", 4)
    said = command("validate", path, "--truth", CLIP, code=3)
    assert said.out == "not comparable\n"
    assert "overlap" in said.err
