"""The scenario of a planted fault as a file that a person could write."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from harness.bench.lab.captures import BOXING, NO_FAULT, PLANTED_FAULTS, planted_scenario
from harness.core.toml_file import format_toml


def write_scenario(folder: Path, kind: str, seed: int) -> Path:
    """Write the scenario of a fault; boxing is the built-in take of 20 s."""
    scenario, lab, take = planted_scenario(kind, seed), planted_scenario(NO_FAULT, seed), PLANTED_FAULTS[kind].take
    clip = "boxing_p1_01" if take == BOXING else take
    content: dict[str, Any] = {
        "schema": 1,
        "methods": ["ik"],
        "seed": scenario.seed,
        "motion": {"source": "builtin", "behaviours": [clip.split("_")[0]], "test": [clip]},
        "stations": {name: asdict(station) for name, station in scenario.stations.items()},
        "fault": [{"kind": fault.kind, "share": fault.share} for fault in scenario.fault],
        "components": scenario.components,
    }
    if scenario.tracker != lab.tracker:
        content["tracker"] = {"latency_s": scenario.tracker.latency_s}
    path = folder / f"{kind}_{seed}.toml"
    path.write_text(format_toml(content), encoding="utf-8")
    return path
