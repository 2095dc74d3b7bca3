"""Provenance of a paper study as tables: runs, databases and test clips, omissions with reasons, constants."""

from collections.abc import Iterator, Sequence
from itertools import chain
from typing import Any

from harness.compare.units import Sampling, count_units
from harness.core.object_state import describe_state
from harness.core.split import ClipPart, allowed_frames
from harness.experiment.cells import open_scenario_motion
from harness.experiment.scenario import Scenario
from harness.reconstruct import registry
from harness.results.cell import varied_text
from harness.results.findings import FindingsTable
from harness.study.papers.paper_study import PaperStudy

TUNING_SCENARIOS = "scenarios/tune_*.toml and validate_*.toml, on the real test clips that they list"


def provenance_tables(study: PaperStudy) -> tuple[FindingsTable, ...]:
    """Tables of the provenance of a study."""
    return (
        FindingsTable(
            "Runs", ("run", "setting", "methods", "inputs", "varied"), tuple(map(_run_row, study.runs.values()))
        ),
        FindingsTable(
            "Test clips and examples",
            (
                "run",
                "behaviour",
                "test clips",
                "units",
                "examples (without the test clip)",
                "frames of examples, at most",
            ),
            tuple(chain.from_iterable(_database_rows(study, scenario) for scenario in study.runs.values())),
        ),
        FindingsTable(
            "Left out", ("run", "what", "why"), tuple(chain.from_iterable(map(_left_out_rows, study.runs.values())))
        ),
        FindingsTable(
            f"Constants of the methods (chosen by {TUNING_SCENARIOS})",
            ("method", "constants"),
            _method_constants(study),
        ),
    )


def _run_row(scenario: Scenario) -> tuple[str, ...]:
    motion = scenario.motion
    setting = (
        f"{motion.source}, split {motion.split}, body {motion.body}, calibration {scenario.calibration}, "
        f"noise {scenario.noise}, {scenario.tracker.rate_hz:g} Hz, seed {scenario.seed}, "
        f"stations {', '.join(scenario.worn_stations)}"
    )
    varied = [
        f"{key}: {', '.join(_varied_value_text(key, value) for value in values)}"
        for key, values in scenario.vary.items()
    ]
    methods, inputs = ", ".join(scenario.methods), ", ".join(scenario.inputs)
    return scenario.name, setting, methods, inputs, "; ".join(varied) or "nothing"


def _varied_value_text(key: str, value: Any) -> str:
    """A varied value without its key."""
    return varied_text({key: value}).removeprefix(f"{key}=")


def _database_rows(study: PaperStudy, scenario: Scenario) -> Iterator[tuple[str, ...]]:
    motion = scenario.motion
    source = open_scenario_motion(motion, study.library, scenario.seed)
    for behaviour in dict.fromkeys(what for _, what in motion.tested):
        tested = [clip for clip, what in motion.tested if what == behaviour]
        same_behaviour = motion.database == "behaviour"
        examples = [name for name in motion.examples if not same_behaviour or source.behaviour(name) == behaviour]
        frames = (round(_example_duration_s(study, scenario, name) * scenario.tracker.rate_hz) for name in examples)
        count = motion.thin_to or round(motion.example_share * sum(frames))
        units = count_units(map(Sampling(unit=scenario.unit).unit_of, tested))
        yield (
            scenario.name,
            behaviour,
            ", ".join(tested),
            units,
            f"{len(examples)}: {', '.join(examples)}",
            f"{count:,}",
        )


def _example_duration_s(study: PaperStudy, scenario: Scenario, name: str) -> float:
    """Duration of an example without its withheld parts [s]."""
    clip = open_scenario_motion(scenario.motion, study.library, scenario.seed).load(ClipPart.parse(name).clip)
    withheld = map(ClipPart.parse, scenario.motion.withheld)
    return sum(map(len, allowed_frames(withheld, clip.name, len(clip), clip.rate_hz))) / clip.rate_hz


def _left_out_rows(scenario: Scenario) -> list[tuple[str, ...]]:
    return [(scenario.name, what, why) for what, why in scenario.left_out.items()]


def _method_constants(study: PaperStudy) -> tuple[tuple[str, ...], ...]:
    names: Sequence[str] = list(dict.fromkeys(chain.from_iterable(s.methods for s in study.runs.values())))
    return tuple((name, describe_state(registry.resolve(name), name)) for name in names)
