"""`harness characterize` as a user meets it."""

import json
from pathlib import Path
from typing import Any

import pytest

from harness.cli import main
from harness.experiment.scenario import load_scenario
from harness.measure.unit_file import read_unit_file

pytestmark = pytest.mark.long


def run(capsys: pytest.CaptureFixture[str], *words: object) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a command."""
    capsys.readouterr()
    code = main([*map(str, words)])
    printed = capsys.readouterr()
    return code, printed.out, printed.err


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("characterize") / "rig.rec"
    assert main(["record", "sim:lab", str(path), "--clip", "rig_p1_01"]) == 0
    return path


@pytest.fixture(scope="module")
def walking(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("walking") / "walking.rec"
    assert main(["record", "sim:demo", str(path), "--clip", "walking_p1_01"]) == 0
    return path


def test_a_capture_gives_a_unit_file_and_a_page(rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before, unit = rig.read_bytes(), tmp_path / "unit.toml"
    code, out, _ = run(capsys, "characterize", rig, "--out", unit, "--rigid", "left_hand,torso")
    assert (code, out.splitlines()[-1]) == (0, "pass")
    assert "rig " in out.splitlines()[0]
    for words in ("error model", "clock and records", "static", "slow", "covered", "stations on a bar", "how long"):
        assert words in out
    assert rig.read_bytes() == before
    assert "Allan deviation" in unit.with_suffix(".html").read_text(encoding="utf-8")
    content = read_unit_file(unit)
    assert content.name == "rig"
    assert content.measured["components.white.position_m"].contains(0.00075)
    assert "components.session.scale" in content.not_measured
    written = unit.read_bytes()
    code, _, err = run(capsys, "characterize", rig, "--out", unit)
    assert (code, "--force" in err) == (2, True)
    assert unit.read_bytes() == written
    again = ("characterize", rig, "--out", unit, "--rigid", "left_hand,torso", "--force")
    assert run(capsys, *again)[0] == 0
    assert unit.read_bytes() == written
    code, out, _ = run(capsys, "characterize", rig, "--expect", unit, "--json")
    found: dict[str, Any] = json.loads(out)
    assert (code, found["departures"]) == (0, [])


def test_a_scenario_simulates_the_unit(rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(capsys, "characterize", rig, "--out", tmp_path / "unit.toml")[0] == 0
    scenario = tmp_path / "fitted.toml"
    text = 'schema = 1\nfitted = "unit.toml"\nmethods = ["ik"]\nstations = "liu2011"\n'
    text += '[motion]\nsource = "builtin"\nbehaviours = ["rig"]\ntest = ["rig_p1_02"]\n'
    scenario.write_text(text, encoding="utf-8")
    white = load_scenario(scenario).components["white"]["position_m"]
    assert white == pytest.approx(0.00075, rel=0.03)
    assert run(capsys, "record", f"sim:{scenario}", tmp_path / "again.rec", "--seconds", "5")[0] == 0


def test_the_rest_of_a_damaged_capture_is_used(rig: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    data = bytearray(rig.read_bytes())
    middle = len(data) // 6
    data[middle : middle + 40] = bytes(40)
    damaged = tmp_path / "damaged.rec"
    damaged.write_bytes(bytes(data[:-7]))
    code, out, _ = run(capsys, "characterize", damaged, "--json")
    found: dict[str, Any] = json.loads(out)
    assert code == 0
    assert len(found["damage"]) == 2
    assert found["parameters"]["components.white.position_m"]["count"] > 8000
    assert "damage" in run(capsys, "characterize", damaged)[1]


def test_bad_input_is_refused_in_one_line(
    rig: Path, walking: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text, negative, unknown = tmp_path / "text.toml", tmp_path / "negative.toml", tmp_path / "unknown.toml"
    text.write_text("nothing = 1\n", encoding="utf-8")
    head = 'sha256 = "edited"\nschema = 2\nkind = "unit"\nname = "u"\n[tracker]\nrate_hz = 40.0\n'
    negative.write_text(f"{head}[components.white]\nposition_m = -0.001\n", encoding="utf-8")
    unknown.write_text(f"{head}[components.white]\ncolour = 1.0\n", encoding="utf-8")
    for words, problem in (
        ((walking,), "no stretch in which a station rests"),
        ((text,), "no recording"),
        ((tmp_path / "none.rec",), "no such file"),
        ((rig, "--rigid", "left_hand"), "two stations"),
        ((rig, "--rigid", "left_hand,left_hand"), "twice"),
        ((rig, "--rigid", "left_hand,nose"), "nose"),
        ((rig, "--expect", text), "unit file"),
        ((rig, "--expect", negative), "position_m"),
        ((rig, "--expect", unknown), "colour"),
        ((rig, "--minutes", "3"), "--minutes"),
        ((rig, "--yes"), "--yes"),
        ((rig, "--baud", "9600"), "--baud"),
        ((rig, "--out", tmp_path / "no" / "unit.toml"), "folder"),
    ):
        code, out, err = run(capsys, "characterize", *words)
        assert (code, out) == (2, "refused\n"), words
        assert problem in err, words
        assert "Traceback" not in err


def test_a_rest_shorter_than_ten_correlation_times_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    slow = tmp_path / "slow.toml"
    text = 'schema = 1\nmethods = ["ik"]\nstations = "liu2011"\ncomponents.drift.correlation_s = 10.0\n'
    text += '[motion]\nsource = "builtin"\nbehaviours = ["rig"]\ntest = ["rig_p1_02"]\n'
    slow.write_text(text, encoding="utf-8")
    assert run(capsys, "record", f"sim:{slow}", tmp_path / "short.rec", "--seconds", "40")[0] == 0
    code, _, err = run(capsys, "characterize", tmp_path / "short.rec")
    assert code == 2
    assert "correlated over" in err


def test_a_port_needs_a_file_to_write(capsys: pytest.CaptureFixture[str]) -> None:
    code, _, err = run(capsys, "characterize", "tcp://127.0.0.1:9")
    assert code == 2
    assert "--out" in err
