"""`harness characterize` as a user meets it."""

from pathlib import Path

import pytest

from harness.cli import main
from harness.experiment.scenarios import load_scenario
from harness.measure import read_unit_file
from tests.command import Command

pytestmark = pytest.mark.long


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


def test_a_capture_gives_a_unit_file_and_a_page(rig: Path, tmp_path: Path, command: Command) -> None:
    before, unit = rig.read_bytes(), tmp_path / "unit.toml"
    said = command("characterize", rig, "--out", unit, "--rigid", "left_hand,torso")
    assert said.lines[-1] == "pass"
    assert "rig " in said.lines[0]
    for words in ("error model", "clock and records", "static", "slow", "covered", "stations on a bar", "how long"):
        assert words in said.out
    assert rig.read_bytes() == before
    assert "Allan deviation" in unit.with_suffix(".html").read_text(encoding="utf-8")
    content = read_unit_file(unit)
    assert content.name == "rig"
    assert content.measured["components.white.position_m"].contains(0.00075)
    assert "components.session.scale" in content.not_measured
    written = unit.read_bytes()
    assert "--force" in command("characterize", rig, "--out", unit, code=2).err
    assert unit.read_bytes() == written
    command("characterize", rig, "--out", unit, "--rigid", "left_hand,torso", "--force")
    assert unit.read_bytes() == written
    assert command("characterize", rig, "--expect", unit, "--json").content["departures"] == []


def test_a_scenario_simulates_the_unit(rig: Path, tmp_path: Path, command: Command) -> None:
    command("characterize", rig, "--out", tmp_path / "unit.toml")
    scenario = tmp_path / "fitted.toml"
    text = 'schema = 1\nfitted = "unit.toml"\nmethods = ["ik"]\nstations = "liu2011"\n'
    text += '[motion]\nsource = "builtin"\nbehaviours = ["rig"]\ntest = ["rig_p1_02"]\n'
    scenario.write_text(text, encoding="utf-8")
    white = load_scenario(scenario).components["white"]["position_m"]
    assert white == pytest.approx(0.00075, rel=0.03)
    command("record", f"sim:{scenario}", tmp_path / "again.rec", "--seconds", "5")


def test_the_rest_of_a_damaged_capture_is_used(rig: Path, tmp_path: Path, command: Command) -> None:
    data = bytearray(rig.read_bytes())
    middle = len(data) // 6
    data[middle : middle + 40] = bytes(40)
    damaged = tmp_path / "damaged.rec"
    damaged.write_bytes(bytes(data[:-7]))
    found = command("characterize", damaged, "--json").content
    assert len(found["damage"]) == 2
    assert found["parameters"]["components.white.position_m"]["count"] > 8000
    assert "damage" in command("characterize", damaged).out


def test_bad_input_is_refused_in_one_line(rig: Path, walking: Path, tmp_path: Path, command: Command) -> None:
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
        ((rig, "--out", text / "unit.toml"), "text.toml"),
    ):
        said = command("characterize", *words, code=2)
        assert said.out == "refused\n", words
        assert problem in said.err, words
        assert "Traceback" not in said.err


def test_a_rest_shorter_than_ten_correlation_times_is_refused(tmp_path: Path, command: Command) -> None:
    slow = tmp_path / "slow.toml"
    text = 'schema = 1\nmethods = ["ik"]\nstations = "liu2011"\ncomponents.drift.correlation_s = 10.0\n'
    text += '[motion]\nsource = "builtin"\nbehaviours = ["rig"]\ntest = ["rig_p1_02"]\n'
    slow.write_text(text, encoding="utf-8")
    command("record", f"sim:{slow}", tmp_path / "short.rec", "--seconds", "40")
    assert "correlated over" in command("characterize", tmp_path / "short.rec", code=2).err


def test_a_port_needs_a_file_to_write(command: Command) -> None:
    assert "--out" in command("characterize", "tcp://127.0.0.1:9", code=2).err
