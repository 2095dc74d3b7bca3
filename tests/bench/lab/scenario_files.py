"""The scenario of a planted fault as a file that a person could write."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from harness.bench.lab.captures import BOXING, NO_FAULT, PLANTED_FAULTS, planted_scenario
from harness.core.toml_text import format_toml_value, toml_table_lines


def write_scenario(folder: Path, kind: str, seed: int) -> Path:
    """Write the scenario of a fault; boxing is the built-in take of 20 s."""
    scenario, lab, take = planted_scenario(kind, seed), planted_scenario(NO_FAULT, seed), PLANTED_FAULTS[kind].take
    clip = "boxing_p1_01" if take == BOXING else take
    lines = ["schema = 1", 'methods = ["ik"]', f"seed = {scenario.seed}"]
    lines += ["[motion]", 'source = "builtin"', f'behaviours = ["{clip.split("_")[0]}"]', f'test = ["{clip}"]']
    for name, station in scenario.stations.items():
        lines += toml_table_lines(f"stations.{name}", asdict(station))
    if scenario.tracker != lab.tracker:
        lines += ["[tracker]", f"latency_s = {scenario.tracker.latency_s}"]
    for fault in scenario.fault:
        lines += ["[[fault]]", f'kind = "{fault.kind}"', f"share = {fault.share}"]
    for name, content in scenario.components.items():
        if isinstance(content, Mapping):
            lines += toml_table_lines(f"components.{name}", content)
        else:
            for table in content:
                lines += [f"[[components.{name}]]", *(f"{k} = {format_toml_value(v)}" for k, v in table.items())]
    path = folder / f"{kind}_{seed}.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
