"""The key `fitted`: a scenario takes over the errors, clock and tracker of a unit file."""

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import pytest

from harness.errors import BadFile, BadInput
from harness.experiment.scenarios.fitted_unit import read_fitted_unit
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.scenarios.scenario_reader import load_scenario
from harness.measure import UnitFile, write_unit_file
from harness.simulate import noise_preset
from tests.core.digested_toml import as_earlier_version

SCENARIO = """
schema = 1
methods = ["ik"]
stations = "liu2011"
{lines}
[motion]
source = "builtin"
behaviours = ["walking"]
test = ["walking_p1_01"]
"""


def unit() -> UnitFile:
    components: dict[str, Any] = {k: v for k, v in asdict(noise_preset("default")).items() if v}
    components["white"]["position_m"] = 0.002
    components["clock"]["drift_ppm"] = 80.0
    components["echo"]["size_m"] = [0.1, 0.2]
    return UnitFile("unit 7", components, {"rate_hz": 60.0})


def load(folder: Path, lines: str, content: UnitFile | None = None) -> Scenario:
    write_unit_file(folder / "unit.toml", content or unit(), force=True)
    (folder / "one.toml").write_text(SCENARIO.format(lines=lines))
    return load_scenario(folder / "one.toml")


def test_a_scenario_takes_over_the_unit(tmp_path: Path) -> None:
    scenario = load(tmp_path, 'fitted = "unit.toml"')
    noise = scenario.noise_model
    assert noise.white is not None
    assert noise.white.position_m == 0.002
    assert noise.clock is not None
    assert noise.clock.drift_ppm == 80.0
    assert noise.echo is not None
    assert noise.echo.size_m == (0.1, 0.2)
    assert noise.excursion == noise_preset("default").excursion
    assert scenario.tracker.rate_hz == 60.0
    assert scenario.noise_label == "unit 7"


def test_a_unit_file_of_an_earlier_version_has_every_field(tmp_path: Path) -> None:
    """A field that a line was lost of would silently be that of the preset."""
    path = tmp_path / "unit.toml"
    write_unit_file(path, replace(unit(), tracker={"rate_hz": 60.0, "items": [40, 2, 11, 21, 1]}))
    text = as_earlier_version(path)
    path.write_text(text)
    assert read_fitted_unit(path).components["white"]["position_m"] == 0.002
    white = text[text.index("[components.white]") : text.index("[components.excursion]")]
    for lost, field in (("position_m = 0.002\n", "white.position_m"), (white, "white.position_m")):
        assert lost in text
        path.write_text(text.replace(lost, "", 1))
        with pytest.raises(BadFile, match=f"damaged: no components.{field}"):
            read_fitted_unit(path)


def test_the_scenarios_own_tables_take_precedence(tmp_path: Path) -> None:
    lines = 'fitted = "unit.toml"\ncomponents.white.position_m = 0.003\ntracker.rate_hz = 50.0\nprofile = "mine"'
    scenario = load(tmp_path, lines)
    noise = scenario.noise_model
    assert noise.white is not None
    assert noise.white.position_m == 0.003
    assert noise.clock is not None
    assert noise.clock.drift_ppm == 80.0
    assert scenario.tracker.rate_hz == 50.0
    assert scenario.noise_label == "mine"


def test_the_values_of_the_unit_are_conditions_and_its_path_is_none(tmp_path: Path) -> None:
    content = load(tmp_path, 'fitted = "unit.toml"').content()
    assert "fitted" not in content
    assert content["components"]["white"]["position_m"] == 0.002
    assert "fitted" not in load(tmp_path, "").content()


@pytest.mark.parametrize(
    ("lines", "error", "message"),
    [
        ('fitted = "unit.toml"\nnoise = "clean"', BadInput, "noise preset"),
        ('fitted = "unit.toml"\nvary.noise = ["clean"]', BadInput, "noise preset"),
        ('fitted = "unit.toml"\n[physics]', BadInput, "count twice"),
        ('fitted = "../unit.toml"', BadFile, "outside the scenario's folder"),
        ('fitted = "other.toml"', BadFile, "no such file"),
        ("fitted = 3", BadInput, "Name a unit file"),
    ],
)
def test_a_contradiction_is_refused(tmp_path: Path, lines: str, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        load(tmp_path, lines)


@pytest.mark.parametrize(
    ("component", "field", "value", "message"),
    [
        ("white", "position_m", -0.001, "white.position_m"),
        ("white", "colour", 1.0, "colour"),
        ("whites", "position_m", 1.0, "whites"),
        ("drift", "correlation_s", 0.0, "correlation_s"),
    ],
)
def test_a_unit_with_unknown_keys_or_negative_spreads_is_refused(
    tmp_path: Path, component: str, field: str, value: float, message: str
) -> None:
    components = {**unit().components, component: {field: value}}
    with pytest.raises(BadFile, match=message):
        load(tmp_path, 'fitted = "unit.toml"', replace(unit(), components=components))
    with pytest.raises(BadFile, match="rate"):
        load(tmp_path, 'fitted = "unit.toml"', replace(unit(), tracker={"rate": 40.0}))
