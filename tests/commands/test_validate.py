"""`harness validate` as a user meets it."""

import csv
import json
from pathlib import Path
from typing import Any

import pytest

from harness.cli import main
from harness.measure.unit_file import read_unit_file

pytestmark = pytest.mark.long
CLIP = "boxing_p1_01"


def run(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a command."""
    capsys.readouterr()
    code = main([*map(str, words)])
    printed = capsys.readouterr()
    return code, printed.out, printed.err


@pytest.fixture(scope="module")
def boxing(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("validate") / "boxing.rec"
    assert main(["record", "sim:builtin_boxing", str(path), "--clip", CLIP, "--noise", "default"]) == 0
    return path


def test_a_capture_is_validated_against_its_clip(
    boxing: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before, unit = boxing.read_bytes(), tmp_path / "unit.toml"
    code, out, _ = run(capsys, "validate", boxing, "--truth", CLIP, "--out", unit, "--methods", "ik")
    assert (code, out.splitlines()[-1]) == (0, "pass")
    for words in (
        "no departure",
        "time offset by orientation",
        "room and mounts",
        "left_hand on lhand",
        "reconstruction",
    ):
        assert words in out
    assert boxing.read_bytes() == before
    assert set(read_unit_file(unit).session) == {"scale", "heading_rad", "latency_s"}
    assert "left_hand on lhand" in unit.with_suffix(".html").read_text(encoding="utf-8")
    code, _, err = run(capsys, "validate", boxing, "--truth", CLIP, "--out", unit)
    assert (code, "--force" in err) == (2, True)
    assert run(capsys, "validate", boxing, "--truth", CLIP, "--out", unit, "--expect", unit, "--force")[0] == 0


def test_a_method_that_fails_leaves_the_validation_and_is_named(
    boxing: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    upright = Path(__file__).parents[1] / "testing" / "upright.py"
    (tmp_path / "diverging.py").write_text(
        upright.read_text().replace(
            "def begin(", "def begin(self, _): raise OverflowError('diverged')\n\n    def unused("
        )
    )
    monkeypatch.syspath_prepend(tmp_path)
    words = ("validate", boxing, "--truth", CLIP, "--methods", "diverging:Upright", "--out", tmp_path / "unit.toml")
    code, out, _ = run(capsys, *words)
    assert (code, out.splitlines()[-1]) == (4, "incomplete")
    assert "failed: diverging:Upright: OverflowError: diverged" in out
    assert read_unit_file(tmp_path / "unit.toml").session


def test_json_holds_every_number_with_its_interval(boxing: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, _ = run(capsys, "validate", boxing, "--truth", CLIP, "--json")
    content: dict[str, Any] = json.loads(out)
    assert (code, content["outcome"]) == (0, "pass")
    ahead = content["numbers"]["components.speed.ahead_s"]
    assert ahead["low"] < ahead["value"] < ahead["high"]
    assert content["matched_share"] > 0.97
    assert (content["departures"], content["exchanged"], content["damage"]) == ([], {}, [])


def test_the_frames_of_replay_are_a_reference(boxing: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _, table, _ = run(capsys, "replay", boxing, "--frames")
    path = tmp_path / "frames.csv"
    path.write_text(table, encoding="utf-8")
    code, out, _ = run(capsys, "validate", boxing, "--truth", path, "--json")
    assert code == 0
    assert abs(json.loads(out)["numbers"]["time_offset_orientation_s"]["value"]) < 1e-6


@pytest.mark.parametrize(("sign", "factor", "cause"), [(-1.0, 1.0, "left-handed"), (1.0, 1.0 / 0.3048, "feet")])
def test_a_mirrored_reference_and_one_in_feet_write_no_file(
    sign: float, factor: float, cause: str, boxing: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, table, _ = run(capsys, "replay", boxing, "--frames")
    path, unit = tmp_path / "frames.csv", tmp_path / "out" / "unit.toml"
    unit.parent.mkdir()
    rows = list(csv.DictReader(table.splitlines()[:-1]))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        for row in rows:
            signs = {"x_m": factor, "y_m": sign * factor, "z_m": factor, "qx": sign, "qz": sign}
            writer.writerow(row | {key: by * float(row[key]) for key, by in signs.items() if row[key]})
    code, out, err = run(capsys, "validate", boxing, "--truth", path, "--out", unit, "--json")
    assert (code, cause in err, json.loads(out)["outcome"]) == (2, True, "refused")
    assert list(unit.parent.iterdir()) == []


def test_methods_need_a_clip(boxing: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, out, err = run(capsys, "validate", boxing, "--truth", boxing, "--methods", "ik")
    assert (code, out) == (2, "refused\n")
    assert "Only a clip has a performer's body" in err


def test_a_short_capture_is_not_comparable(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "short.rec"
    run(capsys, "record", "sim:builtin_boxing", path, "--clip", CLIP, "--seconds", 4)
    code, out, err = run(capsys, "validate", path, "--truth", CLIP)
    assert (code, out) == (3, "not comparable\n")
    assert "overlap" in err
