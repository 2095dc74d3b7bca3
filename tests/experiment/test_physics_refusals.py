"""Mistakes in the table [physics] of a scenario: one clear error each, before anything is simulated where possible."""

from pathlib import Path
from typing import Any

import pytest

from harness.cli import main
from harness.core.package_data import data_folder
from harness.errors import BadFile, BadInput, HarnessError, RenamedKey, UnknownName
from harness.experiment.plan import check_names
from harness.experiment.playback import prepare_playback
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.scenarios.scenario_reader import load_scenario
from harness.simulate import STATISTICAL_COMPONENTS
from harness.study.placement.config import base_scenario, load_placement_study

SCENARIO = """
methods = ["ik:previous"]
stations = "liu2011"
[motion]
source = "builtin"
behaviours = ["boxing"]
test = ["boxing_p1_01"]
longest_s = 2.0
"""
CAVE = (data_folder("models") / "constellations" / "cave.mcf").read_text(encoding="utf-8").splitlines()[1:]
SLIP = '[components]\nmount_slip = [{ station = "head", along_m = 0.01, over_s = 0.0 }]'


def written(folder: Path, extra: str, lines: list[str] | None = None) -> Path:
    """A scenario with more tables, and `room.mcf` beside it."""
    (folder / "room.mcf").write_text("\n".join(CAVE if lines is None else lines), encoding="utf-8")
    path = folder / "mine.toml"
    path.write_text(f"{SCENARIO}\n{extra}\n", encoding="utf-8")
    return path


def checked(path: Path) -> Scenario:
    scenario = load_scenario(path)
    check_names([scenario], None)
    return scenario


@pytest.mark.parametrize(
    ("extra", "kind", "says"),
    [
        ('[physics]\nconstellation.name = "hal"', UnknownName, "constellation called 'hal'. Did you mean 'hall'"),
        ("[physics]\nconstellation.colour = 1", UnknownName, "key in scenario.physics.constellation called 'colour'"),
        ("[physics]\nroom.echo = true", UnknownName, "Did you mean 'echoes'"),
        ("[physics]\nsound.temperature = 1.0", UnknownName, "Did you mean 'temperature_c'"),
        ("[physics]\ninertial.rate = 1.0", UnknownName, "Did you mean 'rate_hz'"),
        ("[physics]\ninertial.gyroscope.whit = 1.0", UnknownName, "Did you mean 'white'"),
        ("[physics]\ninertial.accelerometer.scal = 1.0", UnknownName, "Did you mean 'scale'"),
        ("[physics]\nfusion.gat = 1.0", UnknownName, "Did you mean 'gate'"),
        ("[physics]\nsonund.x = 1", UnknownName, "Did you mean 'sound'"),
        ("[physics]\nconstellation.range_m = -1.0", BadFile, "range_m = -1.0 must be"),
        ("[physics]\nconstellation.survey_sd_m = -0.1", BadFile, "survey_sd_m = -0.1 must be"),
        ("[physics]\nconstellation.cone_deg = nan", BadFile, "cone_deg: expected a finite number"),
        ("[physics]\nroom.reflection = 1.5", BadFile, "reflection = 1.5 must be"),
        ("[physics]\nsound.temperature_c = inf", BadFile, "temperature_c: expected a finite number"),
        ("[physics]\nsound.range_noise_m = -0.1", BadFile, "range_noise_m = -0.1 must be"),
        ("[physics]\nsound.microphones_m = [[0.0, 0.0, 0.0]]", BadInput, "1 positions. A station has 2"),
        ("[physics]\ninertial.rate_hz = 10.0", BadFile, "rate_hz = 10.0 must be"),
        ("[physics]\ninertial.rate_hz = 800.0", BadInput, "sound travels 2.15 m, less than constellation.range_m = 4"),
        ("[physics]\ninertial.gyroscope.white = -1.0", BadFile, "white = -1.0 must be"),
        ("[physics]\ninertial.accelerometer.scale = nan", BadFile, "scale: expected a finite number"),
        ("[physics]\nfusion.warm_up_s = 0.0", BadFile, "warm_up_s = 0.0 must be"),
        ("[physics]\nfusion.gate = -1.0", BadFile, "gate = -1.0 must be"),
        (
            "[physics]\nfusion.prediction_ms = { hed = 20 }",
            UnknownName,
            "prediction_ms called 'hed'. Did you mean 'head'",
        ),
        ("[physics]\nfusion.enhancement = { hed = 1 }", UnknownName, "enhancement called 'hed'. Did you mean 'head'"),
        ("[physics]\nfusion.prediction_ms = { head = 51 }", BadFile, "prediction_ms.head = 51 must be"),
        ("[physics]\nfusion.enhancement = { head = 3 }", BadFile, "enhancement.head = 3 must be"),
        ('[physics]\nconstellation.name = "hall"\nroom.size_m = [5.0, 5.0]', BadInput, "emitter 1 reaches x = -4.57 m"),
        ("[physics]\nroom.height_m = 2.0", BadInput, "emitter 1 reaches z = 2.50 m, and the ceiling is at 2.00 m"),
        (
            "[physics]\nroom.height_m = 2.6\n[tracker]\norigin_m = [0, 0, 3]",
            BadInput,
            "emitter 1 reaches z = 3.00 m",
        ),
        (f"[physics]\n{SLIP}", BadInput, "infinite acceleration"),
        ("[physics]\n[components.strap_slip]\nover_s = 0.0", BadInput, "infinite acceleration"),
        ("[components.physics]", BadInput, "components.physics is no component"),
        (SLIP.replace("head", "nose"), UnknownName, "station called 'nose'"),
        ("[physics]\n[components.wobble]", RenamedKey, "now called 'soft_tissue'"),
        ("[physics]\n[components.loose]", RenamedKey, "now called 'strap_slip'"),
        ("[physics]\n[components.slow]", RenamedKey, "now called 'drift'"),
    ],
)
def test_a_mistake_is_named(extra: str, kind: type[HarnessError], says: str, tmp_path: Path) -> None:
    with pytest.raises(kind) as refusal:
        checked(written(tmp_path, extra))
    assert says in str(refusal.value)


@pytest.mark.parametrize("component", STATISTICAL_COMPONENTS)
def test_a_component_that_counts_twice_is_refused(component: str, tmp_path: Path) -> None:
    checked(written(tmp_path, f"[components.{component}]"))
    with pytest.raises(BadInput, match=rf"components.{component} would count twice"):
        checked(written(tmp_path, f"[physics]\n[components.{component}]"))


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        (CAVE[:2], "2 emitters; expected 3 or more"),
        ([*CAVE[:2], "31F hello"], "line 3: the line '31F hello'"),
        ([*CAVE[:3], CAVE[0].replace("31F      1", "31F     20")], "line 4: emitter 20 at the place of emitter 1"),
        ([CAVE[0].replace("   1.00   5001", "   2.00   5001"), *CAVE[1:]], "line 1: emitter 1 with the normal"),
    ],
)
def test_a_faulty_file_of_emitters_is_refused_with_its_line(lines: list[str], says: str, tmp_path: Path) -> None:
    with pytest.raises(BadFile) as refusal:
        load_scenario(written(tmp_path, '[physics]\nconstellation.file = "room.mcf"', lines))
    assert says in str(refusal.value)
    assert "room.mcf" in str(refusal.value)


def test_the_file_of_emitters_is_read_with_the_scenario(tmp_path: Path) -> None:
    scenario = checked(written(tmp_path, '[physics]\nconstellation.file = "room.mcf"', CAVE[:4]))
    assert scenario.physics is not None
    assert [emitter.number for emitter in scenario.physics.constellation.emitters] == [1, 2, 3, 4]


@pytest.mark.parametrize(
    ("beside", "key", "says"),
    [
        ("room.mcf", "file", "a change of physics.constellation.file"),
        ("", "file", "a change of physics.constellation.file"),
        ("room.mcf", "name", "beside physics.constellation.file"),
    ],
)
def test_a_varied_constellation_is_never_ignored(beside: str, key: str, says: str, tmp_path: Path) -> None:
    """Emitters that were read already would have stayed."""
    extra = f'[physics]\nconstellation.file = "{beside}"\n[vary]\n"physics.constellation.{key}" = ["cave", "hall"]'
    with pytest.raises(BadInput, match=says):
        load_scenario(written(tmp_path, extra))


def test_the_physics_can_be_varied(tmp_path: Path) -> None:
    text = '[vary]\nphysics = ["none", {}]\n"physics.constellation.name" = ["cave", "hall"]'
    names = [v.physics and v.physics.constellation.name for _, v in load_scenario(written(tmp_path, text)).variants()]
    assert names == ["cave", "hall", "cave", "hall"]
    with pytest.raises(UnknownName, match="constellation called 'hal'"):
        checked(written(tmp_path, text.replace('"hall"', '"hal"')))


STUDY = """
kind = "placement"
title = "t"
scenario = "mine"
methods = ["ik:previous"]
{changes}
[[candidate]]
name = "head"
bone = "head"
[[candidate]]
name = "torso"
bone = "thorax"
[ablate]
"""


def study_scenario(folder: Path, changes: str) -> Scenario:
    mine = written(folder, "")
    path = folder / "study.toml"
    path.write_text(STUDY.format(changes=changes), encoding="utf-8")
    return base_scenario(load_placement_study(path), lambda name: load_scenario(mine))


def test_a_study_can_change_the_physics(tmp_path: Path) -> None:
    assert study_scenario(tmp_path, "").physics is None
    assert study_scenario(tmp_path, "changes = { physics = {} }").physics is not None
    changed = study_scenario(tmp_path, 'changes.physics.constellation.name = "hall"').physics
    assert changed is not None
    assert changed.constellation.name == "hall"


@pytest.mark.parametrize(
    ("changes", "kind", "says"),
    [
        ('changes.physics.constellation.file = "room.mcf"', BadInput, "a change of physics.constellation.file"),
        ("changes.physics.fusion.prediction_ms = { left_hand = 1 }", UnknownName, "Known: head, torso"),
        ("changes.physics.sonund.x = 1", UnknownName, "Did you mean 'sound'"),
    ],
)
def test_a_study_is_refused_as_a_scenario_is(changes: str, kind: type[HarnessError], says: str, tmp_path: Path) -> None:
    with pytest.raises(kind) as refusal:
        study_scenario(tmp_path, changes)
    assert says in str(refusal.value)


@pytest.mark.parametrize(
    ("extra", "says"),
    [
        ("[physics]\nconstellation.centre_m = [50.0, 0.0]\nroom.size_m = [150.0, 150.0]", "within reach of an emitter"),
        ("[physics]\nconstellation.centre_m = [6.0, 0.0]\nroom.size_m = [12.0, 12.0]", "The room is too small"),
    ],
)
def test_a_performer_elsewhere_is_refused_by_the_emulator(extra: str, says: str, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=says):
        _ = prepare_playback(written(tmp_path, extra)).samples


@pytest.mark.parametrize(
    "command",
    [
        ["run", "mine.toml", "--no-report", "--jobs", "1"],
        ["emulate", "mine.toml", "--tcp", "127.0.0.1:0"],
        ["record", "sim:mine.toml", "out.rec", "--seconds", "0.1"],
        ["sweep", "all.toml"],
        ["placement", "study.toml", "--jobs", "1"],
    ],
    ids=lambda command: command[0],
)
def test_each_command_refuses_before_it_begins(
    command: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    written(tmp_path, f"[physics]\n{SLIP}")
    (tmp_path / "all.toml").write_text('schema = 1\nname = "all"\nscenarios = ["mine"]\n', encoding="utf-8")
    (tmp_path / "study.toml").write_text(STUDY.format(changes=""), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    before = set(tmp_path.iterdir())
    assert main(command) == 2
    assert "infinite acceleration" in capsys.readouterr().err
    assert set(tmp_path.iterdir()) == before, "nothing is written"
