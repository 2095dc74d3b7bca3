"""Everything that can be named on the command line or in a scenario, with a line about each."""

from pathlib import Path

import numpy as np

from harness.body import NAMED_PLACES, build_body
from harness.core.humanoid24 import QPOS_OF_DOF
from harness.core.number_format import count_noun
from harness.core.split import declared_training_data, training_note
from harness.experiment import cell_names
from harness.experiment.scenarios import (
    Scenario,
    expand_sweep,
    load_scenario,
    load_sweep,
    shipped_scenarios,
    shipped_sweeps,
)
from harness.mocap import synthetic
from harness.reconstruct import list_methods, make_method, method_origin
from harness.report.figures.writer import KINDS
from harness.score import DEFINITIONS, SIGMA_DEFINITIONS
from harness.stream import INPUT_COMBINATIONS
from harness.study.placement.config import load_placement_study, shipped_placements

TUNING_PREFIXES = ("tune_", "validate_")
"""Beginnings of the names of scenarios that only choose or check constants (docs/notes/constants.toml)."""


def build_catalogue(*, every: bool = False) -> dict[str, dict[str, str]]:
    """Title -> name -> one line. `every`: also the scenarios that only choose or check constants."""
    scenarios = [path.stem for path in shipped_scenarios()]
    return {
        "methods": {name: _describe_method(name) for name in list_methods()},
        "scenarios": {
            name: _describe_scenario(name) for name in scenarios if every or not name.startswith(TUNING_PREFIXES)
        },
        "placement studies": {path.stem: load_placement_study(path).title for path in shipped_placements()},
        "sweeps": {path.stem: _describe_sweep(path) for path in shipped_sweeps()},
        f"motion of the {synthetic.SOURCE}": {
            b: _describe_takes(synthetic.take_names(b)) for b in synthetic.BEHAVIOURS
        },
        "inputs": dict(INPUT_COMBINATIONS),
        "noise": {
            "clean": "what the tracker would say if it were perfect",
            "noise": "white, slow and session errors, and the device's clock",
            "default": "all of it: also excursions, echoes, short losses and the error of fast motion",
        },
        "figures": {name: kind.text for name, kind in KINDS.items()},
        "places": {place.name: f"{place.text}; bone {place.bone}" for place in NAMED_PLACES.values()},
        "hinges in the order of qpos": _describe_hinges(),
        "metrics": {name: f"[{d.unit}] {d.text}" for name, d in {**DEFINITIONS, **SIGMA_DEFINITIONS}.items()},
    }


def _describe_method(name: str) -> str:
    """What it does, what it needs, and where it comes from."""
    method = make_method(name)
    examples = "examples" if method.needs_examples else "no examples"
    note = training_note(declared_training_data(method))
    said = [method.summary, f"needs {examples}, takes any inputs", note, method_origin(name)]
    return "; ".join(part for part in said if part)


def _describe_hinges() -> dict[str, str]:
    """The 48 hinges by name, in the order of `qpos[7:]`, which reverses the skeleton's order within each bone."""
    body, found = build_body(), dict[str, str]()
    for place, dof in enumerate(QPOS_OF_DOF, start=7):  # the order is its own inverse
        axis, (low, high) = body.skeleton.axes[dof], np.rad2deg(body.limits_rad[dof])
        about = f"axis ({axis[0]:.2f}, {axis[1]:.2f}, {axis[2]:.2f}) of its bone"
        found[body.skeleton.dof_names[dof]] = f"qpos[{place}]; {about}; {low:.0f} to {high:.0f} deg"
    return found


def _describe_scenario(name: str) -> str:
    scenario = load_scenario(name)
    motion = scenario.motion
    return (
        f"{motion.source}: {', '.join(dict.fromkeys(motion.behaviours))}; {count_noun(len(motion.test), 'clip')}, "
        f"{len(scenario.worn_stations)} stations, {_describe_noise(scenario)}; {len(scenario.methods)} methods"
    )


def _describe_sweep(path: Path) -> str:
    scenarios = expand_sweep(*load_sweep(path))
    cells = sum(len(cell_names(scenario)) for scenario in scenarios)
    return f"{', '.join(dict.fromkeys(s.name for s in scenarios))}, {_describe_noise(scenarios[0])}; {cells} cells"


def _describe_noise(scenario: Scenario) -> str:
    """What varies; without that the noise."""
    keys = dict.fromkeys(key for combination, _ in scenario.variants() for key in combination)
    return f"varies {', '.join(keys)}" if keys else f"noise {scenario.noise}"


def _describe_takes(names: tuple[str, ...]) -> str:
    return f"{len(names)} takes, {names[0]} to {names[-1]}"
