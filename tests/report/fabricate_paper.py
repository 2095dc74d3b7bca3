"""Fabricated findings in the form that the paper studies write; none of their numbers was measured."""

import math
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

from harness.core.seeds import generator
from harness.results.benchmark_statement import BenchmarkStatement
from harness.results.findings import BarChart, FindingsTable, LineChart, PaperExperiment, PaperFindings, write_findings

METHODS: Mapping[str, float] = {"dynamic_map": 1.0, "local_pca": 1.6, "ik": 2.4}
"""Method -> size of its errors [deg], in the order that the paper expects."""
BEHAVIOURS = ("walking", "boxing", "jumping", "golf", "table tennis")
STATIONS = ("RH", "LH", "RA", "LA", "PEL")
INPUTS = {"positions and orientations": 1.25, "positions, torso's orientation": 2.25, "positions": 2.52, "mixed": 3.27}
"""Inputs -> published error [deg]."""
GENERATED = "The motion comes from a generator, not from a Vicon system; 8 clips instead of one per action."
CIRCUMSTANCES = {
    "harness": "0.1.0",
    "commit": "0123456789abcdef0123456789abcdef01234567",
    "dirty": True,
    "python": "3.11.2",
    "packages": {"numpy": "2.3.1", "mujoco": "4.0.0"},
}


def write_study(folder: Path, findings: PaperFindings) -> Path:
    """Write the folder of a study without runs."""
    folder.mkdir(parents=True, exist_ok=True)
    write_findings(folder / "findings.json", findings)
    return folder


def liu() -> PaperFindings:
    """Findings with every kind of figure and every verdict."""
    errors = {name: _errors(name, size) for name, size in METHODS.items()}
    orders = [_order(n, *pair, errors) for n in range(len(BEHAVIOURS)) for pair in pairwise(METHODS)]
    figures = [
        BenchmarkStatement(
            f"boxing, {name}", f"{theirs} deg", f"{theirs + 0.4:.2f} deg", "not comparable", "built-in motion", 2
        )
        for name, theirs in INPUTS.items()
    ]
    modes = BenchmarkStatement(
        "five modes keep about 99 %", "99 %", "91.2 %", "not reproduced", "fewer skeletons, more noise"
    )
    speed = BenchmarkStatement(
        "35 frames a second with 65,922 frames", "35 frames/s", "", "not run", "there was no time"
    )
    question = "Is the paper's order the order here? The paper shows bars of mean and standard deviation (Fig. 6)."
    return PaperFindings(
        paper="liu2011",
        reference="Liu, Wei, Chai, Ha, Rhee: Realtime human motion control, I3D 2011",
        motion="built-in performer",
        command="harness paper liu2011",
        seed=1,
        experiments=(
            PaperExperiment(
                "leave_one_out",
                "One sequence left out",
                question,
                (GENERATED, "Golf has 2 clips only."),
                tuple(orders),
                (_table(errors),),
                (_grouped(errors),),
                ("leave_one_out", "not_there"),
                ("local_pca falls behind ik on performers whom the database does not know.",),
            ),
            PaperExperiment("frame_by_frame", "Frame by frame", question, (GENERATED,), figures=(curves(400),)),
            PaperExperiment("inputs", "Inputs", question, (), tuple(figures), figures=(_inputs(),)),
            PaperExperiment("eigenmodes", "Eigenmodes of bone lengths", question, (), (modes,)),
            PaperExperiment("speed", "Frame rate", question, (), (speed,)),
        ),
        circumstances=CIRCUMSTANCES,
        tables=(FindingsTable("Databases", ("behaviour", "frames"), (("walking", "17,920"), ("boxing", "31,360"))),),
    )


def kim() -> PaperFindings:
    """Findings with 31 horizontal bars and a sparse database."""
    differences = ("All 31 sets of the five trackers were run.",)
    best = BenchmarkStatement(
        "boxing: RH+LH+PEL errs least", "called suitable", "1st of 10", "cannot tell", "5 clips, of 6", 5
    )
    figures = tuple(sets(behaviour) for behaviour in ("walking", "boxing"))
    return PaperFindings(
        paper="kim2012",
        reference="Kim, Seol, Lee: Realtime performance animation using sparse 3D motion sensors, 2012",
        motion="cmu",
        command="harness paper kim2012 --mocap mocap",
        seed=1,
        experiments=(
            PaperExperiment("sets", "Sets of trackers", "15 sets (Fig. 3).", differences, (best,), figures=figures),
            PaperExperiment("sparse", "Sparse databases", "43 frames of walking.", (), figures=(curves(300),)),
        ),
        circumstances=CIRCUMSTANCES,
    )


def sets(behaviour: str) -> BarChart:
    """Errors of all 31 sets of five stations."""
    rng = generator(1, "made-up findings", behaviour)
    masks = sorted(range(1, 2 ** len(STATIONS)), key=lambda mask: mask.bit_count())
    names = tuple("+".join(name for bit, name in enumerate(STATIONS) if mask >> bit & 1) for mask in masks)
    errors = tuple(12.0 / mask.bit_count() + float(rng.uniform(0.0, 1.5)) for mask in masks)
    return BarChart(
        f"All 31 sets of trackers, {behaviour}",
        "deg",
        names,
        {"kernel_cca": errors},
        low={"kernel_cca": tuple(0.9 * error for error in errors)},
        high={"kernel_cca": tuple(1.15 * error for error in errors)},
        horizontal=True,
    )


def curves(frames: int) -> LineChart:
    """Errors over time; ik has a gap."""
    rng = generator(1, "made-up findings", frames)
    series = {
        name: tuple(
            None if name == "ik" and 100 <= n < 130 else size * (1.2 + math.sin(0.05 * n + size) + 0.1 * rng.random())
            for n in range(frames)
        )
        for name, size in METHODS.items()
    }
    x = tuple(n / 40.0 for n in range(frames))
    return LineChart("walking_p1_01", "time [s]", "mean joint-angle error [deg]", x, series)


def _errors(name: str, size: float) -> tuple[float, ...]:
    rng = generator(1, "made-up findings", name)
    return tuple(float(x) for x in rng.uniform(size, 1.4 * size, len(BEHAVIOURS)))


def _order(n: int, less: str, more: str, errors: Mapping[str, tuple[float, ...]]) -> BenchmarkStatement:
    """A claim about an order; golf has too few clips."""
    ours, theirs = errors[less][n], errors[more][n]
    few = BEHAVIOURS[n] == "golf"
    return BenchmarkStatement(
        text=f"{BEHAVIOURS[n]}, positions and orientations: {less} errs less than {more}",
        target="order",
        measured=f"{ours:.2f} against {theirs:.2f} deg",
        verdict="cannot tell" if few else "reproduced",
        why="too few units: 2, of at least 6" if few else "",
        clips=2 if few else 8,
        value=theirs - ours,
        low=None if few else theirs - ours - 0.1,
        high=None if few else theirs - ours + 0.2,
        unit="deg",
    )


def _grouped(errors: Mapping[str, tuple[float, ...]]) -> BarChart:
    return BarChart(
        "One sequence left out",
        "deg",
        BEHAVIOURS,
        dict(errors),
        low={name: tuple(error - 0.2 for error in each) for name, each in errors.items()},
        high={name: tuple(error + 0.25 for error in each) for name, each in errors.items()},
        spread=dict.fromkeys(errors, (0.4, 0.5, 0.45, None, 0.3)),
        caption="Mean joint-angle error over clips.",
    )


def _inputs() -> BarChart:
    """A bar chart in which one bar and one interval are missing."""
    return BarChart(
        "Four combinations of inputs, boxing",
        "deg",
        tuple(INPUTS),
        {"dynamic_map": (1.21, 2.61, None, 3.28)},
        low={"dynamic_map": (1.0, 2.3, None, None)},
        high={"dynamic_map": (1.4, 2.9, None, None)},
        published={"dynamic_map": tuple(INPUTS.values())},
    )


def _table(errors: Mapping[str, tuple[float, ...]]) -> FindingsTable:
    rows = [
        (b, name, f"{each[n]:.2f} ± 0.40", "8", "") for n, b in enumerate(BEHAVIOURS) for name, each in errors.items()
    ]
    return FindingsTable("Errors", ("behaviour", "method", "joint angle [deg]", "clips", "remark"), tuple(rows))
