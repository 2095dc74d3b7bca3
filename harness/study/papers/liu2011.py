"""Reproduction of Liu et al. 2011: every experiment of docs/papers.md A6, and the speed that the paper states."""

from functools import partial
from itertools import pairwise

from harness.compare.claims import claim_lower_error, claim_published_value
from harness.mocap.sources import read_skeletons
from harness.mocap.synthetic import sample_skeletons
from harness.results.benchmark_statement import Reading, StatementKind
from harness.results.expected_orders import METRIC
from harness.results.findings import PaperExperiment
from harness.study.papers.database_size import database_size, one_database
from harness.study.papers.eigenmodes import evaluate_bone_modes
from harness.study.papers.frame_by_frame import frame_by_frame
from harness.study.papers.leave_one_out import (
    DYNAMIC_MAP,
    DYNAMIC_MAP_LITERAL,
    DYNAMIC_MAP_WINDOW,
    INPUTS,
    RUNS,
    differences,
    leave_one_out,
    own_model,
)
from harness.study.papers.other_approaches import RUN as OTHER_RUN
from harness.study.papers.other_approaches import other_approaches
from harness.study.papers.paper import Paper
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.published_speed import LIU2011, compare_speed
from harness.study.papers.tables import RMS, errors_by_joint_group, errors_by_unit, mean_bars, mean_table

PUBLISHED_DEG = {"pos+ori": 1.25, "pos+torso_ori": 2.25, "pos": 2.52, "mixed": 3.27}
_READINGS: dict[str, Reading] = {DYNAMIC_MAP_LITERAL: "as printed", DYNAMIC_MAP: "ours", DYNAMIC_MAP_WINDOW: "ours"}
_KINDS: dict[str, StatementKind] = {
    DYNAMIC_MAP_LITERAL: "printed",
    DYNAMIC_MAP: "printed",
    DYNAMIC_MAP_WINDOW: "repeated",
}
_SYNTHETIC_PEOPLE = 20
"""Number of synthetic skeletons: as many CMU skeletons define the spread that they are drawn from."""


def boxing_inputs(study: PaperStudy) -> PaperExperiment:
    """Four combinations of inputs, the only experiment for which the paper prints errors."""
    real = study.motion == "cmu"
    first = "blocks" if real else "leave_one_out"  # has two of the four combinations, on the same clips
    runs = {inputs: first if inputs in ("pos+ori", "pos") else "boxing_inputs" for inputs in PUBLISHED_DEG}
    errors, roots = (
        {
            method: {
                i: errors_by_unit(study.rows(run, behaviour="boxing", method=method, inputs=i), metric)
                for i, run in runs.items()
            }
            for method in (DYNAMIC_MAP_LITERAL, DYNAMIC_MAP, DYNAMIC_MAP_WINDOW)
        }
        for metric in (METRIC, RMS)
    )
    orders = [
        claim_lower_error(
            f"{method}: {INPUTS[lower]} err less than {INPUTS[higher]}",
            each[lower],
            each[higher],
            published=f"{PUBLISHED_DEG[lower]:.2f} < {PUBLISHED_DEG[higher]:.2f} deg",
            kind=_KINDS[method],
            reading=_READINGS[method],
        )
        for method, each in errors.items()
        for lower, higher in pairwise(PUBLISHED_DEG)
    ]
    why = "other clips and fewer examples" if real else "synthetic motion, for which no paper has a figure"
    figures = [
        claim_published_value(
            *(f"{method}: {INPUTS[inputs]}", published, each[inputs]),
            comparable=real,
            why=why,
            kind=_KINDS[method],
            reading=_READINGS[method],
        )
        for method, each in errors.items()
        for inputs, published in PUBLISHED_DEG.items()
    ]
    groups, root_groups = (
        {INPUTS[i]: {method: each[i] for method, each in side.items()} for i in PUBLISHED_DEG}
        for side in (errors, roots)
    )
    joints, root_joints = (
        {
            INPUTS[i]: errors_by_joint_group(
                study.cells(run, behaviour="boxing", method=DYNAMIC_MAP, inputs=i), metric=metric
            )
            for i, run in runs.items()
        }
        for metric in (METRIC, RMS)
    )
    bars = mean_bars(
        "Error by inputs",
        "deg",
        groups,
        caption="Mean joint-angle error over units.",
        published={DYNAMIC_MAP: tuple(PUBLISHED_DEG.values())},
    )
    blocks = (
        "About 5 s of a bout are left out, with 1 s around them; the rest is in the database. This is closest to the "
        "paper."
    )
    return PaperExperiment(
        name="boxing_inputs",
        title="Four combinations of inputs on boxing",
        question=(
            "How does the error grow when readings are left out? The paper prints 1.25 degrees for positions and "
            "orientations of all six trackers, 2.25 for all positions and the torso's orientation, 2.52 for all "
            "positions, and 3.27 for positions of torso and ankles with orientations of torso, head and hands."
        ),
        differences=(*((blocks,) if real else ()), *differences(study)),
        claims=(*orders, *figures),
        tables=(
            mean_table("Joint-angle error [deg]", "inputs", groups, root_groups),
            mean_table(f"Error of {DYNAMIC_MAP} by joint group [deg]", "inputs", joints, root_joints),
        ),
        figures=(bars,),
        runs=(first, "boxing_inputs"),
    )


def eigenmodes(study: PaperStudy) -> PaperExperiment:
    """Fig. 4: principal modes of bone lengths."""
    if study.library:
        return evaluate_bone_modes(
            read_skeletons(study.library), "those of the library", measured=True, seed=study.seed
        )
    people = {f"person {n}": person for n, person in enumerate(sample_skeletons(_SYNTHETIC_PEOPLE, study.seed), 1)}
    return evaluate_bone_modes(
        people, "drawn from the distribution of the CMU skeletons", measured=False, seed=study.seed
    )


PAPER = Paper(
    "liu2011",
    "Liu, Wei, Chai, Ha, Rhee: Realtime human motion control with a small number of inertial sensors, I3D 2011",
    {
        "leave_one_out": leave_one_out,
        "own_model": own_model,
        "frame_by_frame": frame_by_frame,
        "boxing_inputs": boxing_inputs,
        "database_size": database_size,
        "one_database": one_database,
        "other_approaches": other_approaches,
        "eigenmodes": eigenmodes,
        "speed": partial(compare_speed, published=LIU2011),
    },
    runs_of={
        "leave_one_out": RUNS,
        "own_model": RUNS,
        "frame_by_frame": ("leave_one_out",),
        "boxing_inputs": ("leave_one_out", "blocks", "boxing_inputs"),
        "database_size": ("leave_one_out", "blocks", "database_size"),
        "one_database": ("leave_one_out", "blocks", "one_database"),
        "other_approaches": ("leave_one_out", "blocks", OTHER_RUN),
        "eigenmodes": (),
        "speed": (),
    },
)
