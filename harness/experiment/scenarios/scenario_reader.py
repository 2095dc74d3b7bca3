"""Reading of scenarios: a TOML file or a shipped name becomes one frozen record, complete and checked."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from harness.core.fields import NONE, build
from harness.core.file_kind import check_toml_kind
from harness.core.files import MAX_TOML_BYTES, read_toml
from harness.core.input_file import check_input_file, names_input_file
from harness.core.options import expand_alternatives
from harness.core.package_data import data_folder
from harness.core.ranges import check_words
from harness.errors import BadFile, UnknownName, name_file
from harness.experiment.scenarios.fitted_unit import merge_fitted_unit
from harness.experiment.scenarios.scenario import Scenario
from harness.experiment.scenarios.scenario_checks import check_expected_orders, check_scenario

_STATION_SETS_FILE = "stations.toml"


def load_scenario(path: Path | str) -> Scenario:
    """Load the scenario in a TOML file, or the shipped scenario of that name.

    Raises BadFile, UnknownName and RenamedKey, which name the place. Patterns in clip lists stay (see `expand_clips`).
    """
    return ScenarioFile(find_scenario(path)).scenario


@dataclass(frozen=True)
class ScenarioFile:
    """The TOML file of a scenario."""

    path: Path

    @property
    def scenario(self) -> Scenario:
        """The scenario, checked; with its set of stations, its measured unit and its constellation read."""
        path = self.path
        expected, advice = "a scenario", "`harness list` names the shipped ones."
        content = read_toml(path, expected, advice)
        check_toml_kind(path, content, expected, advice)
        content.setdefault("name", path.stem)
        with name_file(path):
            try:
                scenario = self._build(content)
            except (TypeError, ValueError) as error:
                raise BadFile(path, str(error), "", "See the shipped ones in scenarios/.") from error
            check_scenario(path, scenario)
            check_expected_orders(path, scenario)
        return scenario

    def _build(self, content: dict[str, Any]) -> Scenario:
        """The scenario of the file's content; other files are named relative to the folder of this one."""
        folder = self.path.parent
        if "stations" in content:
            content["stations"] = expand_station_set(content["stations"])
        if "fitted" in content:
            content = merge_fitted_unit(content, folder)
        scenario = build(Scenario, content, "scenario")
        scenario = replace(
            scenario, methods=tuple(name for text in scenario.methods for name in expand_alternatives(text))
        )
        if (physics := scenario.physics) is None:
            return scenario
        constellation = physics.constellation.with_file_read(folder)
        return replace(scenario, physics=replace(physics, constellation=constellation))


def expand_station_set(stations: Any) -> Any:
    """The table of stations that a scenario means by `stations`: the name of a set, or a table.

    A table whose key `set` names a set starts from that set: a table of a station changes the values it names, or adds
    the station after the others; "none" leaves the station out. UnknownName for a set or a station that is not there.
    """
    if isinstance(stations, str):
        stations = {"set": stations}
    if not isinstance(stations, Mapping) or not isinstance(stations.get("set"), str):
        return stations
    sets = read_station_sets()
    if stations["set"] not in sets:
        raise UnknownName("set of stations", stations["set"], sets)
    expanded = {name: dict(station) for name, station in sets[stations["set"]].items()}
    for name, change in stations.items():
        if change == NONE and name not in expanded:
            raise UnknownName(f"station of {stations['set']}", name, expanded)
        if change == NONE:
            del expanded[name]
        elif name != "set":
            expanded[name] = {**expanded.get(name, {}), **change} if isinstance(change, Mapping) else change
    return expanded


@cache
def read_station_sets() -> dict[str, dict[str, Any]]:
    """The shipped sets of stations: set -> station -> its table (see `Station`)."""
    return read_toml(data_folder("scenarios") / _STATION_SETS_FILE, "sets of stations", "Install the package again.")


def find_scenario(path: Path | str, beside: Path | None = None) -> Path:
    """The path of a scenario: a file, or a shipped scenario by its bare name. UnknownName, BadFile.

    With a folder `beside`, a file there comes first, then one in the folder of shipped scenarios, both with or without
    `.toml` in their names.
    """
    for folder in (beside, data_folder("scenarios")) if beside is not None else ():
        for file in (folder / path, folder / f"{path}.toml"):
            if names_input_file(file):
                return file
    return find_config(
        path, "scenario", Path("scenarios"), shipped_scenarios(), "`harness list` names the shipped ones."
    )


def find_config(path: Path | str, kind: str, folder: Path, shipped: Sequence[Path], advice: str) -> Path:
    """The path of a file in TOML of a kind, such as "sweep": a file, or a shipped one by its bare name.

    A shipped one is also found by its name in the `folder` of the repository. UnknownName, BadFile with this advice.
    """
    given = Path(path)
    check_words(given)
    if names_input_file(given):
        return given
    by_name = {file.stem: file for file in shipped}
    if given.suffix in ("", ".toml") and given.stem in by_name and given.parent in (Path(), folder):
        return by_name[given.stem]
    if given.parent == Path() and not given.suffix and not given.is_dir():
        raise UnknownName(kind, str(path), by_name)
    check_input_file(given, f"a {kind} in TOML", MAX_TOML_BYTES, advice)
    return given


def shipped_scenarios() -> list[Path]:
    """The files of the shipped scenarios that a bare name finds."""
    return sorted(path for path in data_folder("scenarios").glob("*.toml") if path.name != _STATION_SETS_FILE)
