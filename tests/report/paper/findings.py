"""Findings that the functions of the paper studies make of errors by unit; the errors are drawn, not measured."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np

from harness.core.seeds import generator
from harness.results.findings import (
    BarChart,
    BenchmarkStatement,
    FindingsTable,
    LineChart,
    PaperExperiment,
    PaperFindings,
    write_findings,
)
from harness.study.papers.claims import claim_lower_error, claim_published_value
from harness.study.papers.station_sets import ranked_bars
from harness.study.papers.tables import mean_bars, mean_table

METHODS: Mapping[str, float] = {"dynamic_map": 1.0, "local_pca": 1.6, "ik": 2.4}
"""Method -> size of its errors [deg], in the order that the paper expects."""
BEHAVIOURS = ("walking", "boxing", "jumping", "golf", "table tennis")
STATIONS = ("RH", "LH", "RA", "LA", "PEL")
INPUTS = {"positions and orientations": 1.25, "positions, torso's orientation": 2.25, "positions": 2.52, "mixed": 3.27}
"""Inputs -> published error [deg]."""
GENERATED = "The motion comes from a generator, not from a Vicon system; 8 clips instead of one per action."
QUESTION = "Is the paper's order the order here? The paper shows bars of mean and standard deviation (Fig. 6)."
CIRCUMSTANCES = {"harness": "0.1.0", "commit": "0123456789abcdef", "dirty": True, "packages": {"numpy": "2.3.1"}}


def write_study(folder: Path, findings: PaperFindings) -> Path:
    """Write the folder of a study without runs."""
    folder.mkdir(parents=True, exist_ok=True)
    write_findings(folder / "findings.json", findings)
    return folder


def drawn_errors(size: float, *names: str | int, units: int = 8) -> dict[str, float]:
    """Unit -> error of about this size [deg]."""
    draws = generator(1, "drawn errors", *names).uniform(size, 1.3 * size, units)
    return {f"performer p{n + 1}": float(error) for n, error in enumerate(draws)}


@cache
def liu() -> PaperFindings:
    """Every kind of figure and every verdict; golf has 2 clips."""
    errors = {
        behaviour: {
            method: drawn_errors(size, behaviour, method, units=2 if behaviour == "golf" else 8)
            for method, size in METHODS.items()
        }
        for behaviour in BEHAVIOURS
    }
    errors["boxing"]["local_pca"] = drawn_errors(3.0, "boxing", "worse than ik")
    orders = [
        claim_lower_error(f"{behaviour}: {less} errs less than {more}", each[less], each[more])
        for behaviour, each in errors.items()
        for less, more in pairwise(METHODS)
    ]
    inputs = {name: {"dynamic_map": drawn_errors(theirs, name)} for name, theirs in INPUTS.items()}
    inputs["positions"] = {"dynamic_map": {}}
    values = [
        claim_published_value(
            f"boxing, {name}", theirs, inputs[name]["dynamic_map"], comparable=False, why="built-in motion"
        )
        for name, theirs in INPUTS.items()
    ]
    published = {"dynamic_map": tuple(INPUTS.values())}
    speed = BenchmarkStatement("35 frames a second", "35 frames/s", "", "not run", "there was no time")
    experiments = (
        PaperExperiment(
            "leave_one_out",
            "One sequence left out",
            QUESTION,
            (GENERATED, "Golf has 2 clips only."),
            tuple(orders),
            (mean_table("Errors", "behaviour", errors),),
            (mean_bars("One sequence left out", "deg", errors),),
            ("leave_one_out", "not_there"),
            ("local_pca falls behind ik in boxing.",),
        ),
        PaperExperiment("frame_by_frame", "Frame by frame", QUESTION, (GENERATED,), figures=(curves(400),)),
        PaperExperiment(
            "inputs",
            "Inputs",
            QUESTION,
            (),
            tuple(values),
            figures=(mean_bars("Four combinations of inputs", "deg", inputs, published=published),),
        ),
        PaperExperiment("speed", "Frame rate", QUESTION, (), (speed,)),
    )
    return PaperFindings(
        paper="liu2011",
        reference="Liu, Wei, Chai, Ha, Rhee: Realtime human motion control, I3D 2011",
        motion="built-in performer",
        command="harness paper liu2011",
        seed=1,
        experiments=experiments,
        circumstances=CIRCUMSTANCES,
        tables=(FindingsTable("Databases", ("behaviour", "frames"), (("walking", "17,920"), ("boxing", "31,360"))),),
    )


@cache
def kim() -> PaperFindings:
    """31 horizontal bars of each behaviour."""
    few = claim_lower_error("boxing: RH+LH errs least", drawn_errors(1.0, 1, units=5), drawn_errors(2.0, 2, units=5))
    figures = tuple(sets(behaviour) for behaviour in ("walking", "boxing"))
    experiments = (
        PaperExperiment("sets", "Sets of trackers", "15 sets (Fig. 3).", ("All sets were run.",), (few,), (), figures),
        PaperExperiment("sparse", "Sparse databases", "43 frames of walking.", (), figures=(curves(300),)),
    )
    return replace(
        liu(),
        paper="kim2012",
        reference="Kim, Seol, Lee: Realtime performance animation, 2012",
        motion="cmu",
        command="harness paper kim2012",
        experiments=experiments,
        tables=(),
    )


@cache
def sets(behaviour: str) -> BarChart:
    """Errors of all 31 sets of five stations."""
    masks = range(1, 2 ** len(STATIONS))
    names = ["+".join(name for bit, name in enumerate(STATIONS) if mask >> bit & 1) for mask in masks]
    errors = {name: drawn_errors(12.0 / (1 + name.count("+")), behaviour, name) for name in names}
    return ranked_bars(f"All 31 sets of trackers, {behaviour}", errors, "Bars: means.")


@cache
def curves(frames: int) -> LineChart:
    """Errors over time as `tables.error_lines` gives them; ik has no estimate for 0.75 s."""
    rng, time_s = generator(1, "curves", frames), np.arange(frames) / 40.0
    series = {}
    for name, size in METHODS.items():
        values = size * (1.2 + np.sin(2.0 * time_s + size) + 0.1 * rng.random(frames))
        lost = (time_s >= 2.5) & (time_s < 3.25) & (name == "ik")
        series[name] = tuple(None if gap else float(value) for value, gap in zip(values, lost, strict=True))
    return LineChart("walking_p1_01", "time [s]", "mean joint-angle error [deg]", tuple(map(float, time_s)), series)
