"""Reproduction of Liu et al. 2011: every experiment of docs/papers.md A6, with inputs, frames, modes and speed."""

from collections.abc import Iterator, Mapping
from functools import partial
from itertools import pairwise

import numpy as np

from harness.mocap import read_skeletons
from harness.mocap.synthetic import sample_skeletons
from harness.results.findings import FindingsTable, LineChart, PaperExperiment, Reading, StatementKind
from harness.study.papers.bone_lengths import evaluate_bone_modes
from harness.study.papers.claims import claim_lower_error, claim_published_value
from harness.study.papers.database_size import database_size, one_database, other_approaches
from harness.study.papers.leave_one_out import (
    DYNAMIC_MAP,
    DYNAMIC_MAP_LITERAL,
    DYNAMIC_MAP_WINDOW,
    INPUTS,
    METHODS,
    RUNS,
    differences,
    leave_one_out,
    own_model,
)
from harness.study.papers.paper import Paper
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.published_speed import LIU2011, compare_speed
from harness.study.papers.tables import RMS, error_lines, errors_by_joint_group, errors_by_unit, mean_bars, mean_table

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
    errors = {
        method: {
            i: errors_by_unit(study.rows(run, behaviour="boxing", method=method, inputs=i)) for i, run in runs.items()
        }
        for method in (DYNAMIC_MAP_LITERAL, DYNAMIC_MAP, DYNAMIC_MAP_WINDOW)
    }
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
    groups = {INPUTS[i]: {method: each[i] for method, each in errors.items()} for i in PUBLISHED_DEG}
    joints = {
        INPUTS[i]: errors_by_joint_group(study.cells(run, behaviour="boxing", method=DYNAMIC_MAP, inputs=i))
        for i, run in runs.items()
    }
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
            mean_table("Joint-angle error [deg]", "inputs", groups),
            mean_table(f"Error of {DYNAMIC_MAP} by joint group [deg]", "inputs", joints),
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


def frame_by_frame(study: PaperStudy) -> PaperExperiment:
    """Errors over time of the first walk and the first jump that the scenario lists, chosen before any run."""
    rows: list[tuple[str, ...]] = []
    figures: list[LineChart] = []
    for behaviour in ("walking", "jumping"):
        motion = study.runs["leave_one_out"].motion
        where = {"behaviour": behaviour, "inputs": "pos+ori", "clip": motion.test[motion.behaviours.index(behaviour)]}
        title = f"{behaviour}, {where['clip']}"
        cells = {cell.method: cell for _, cell in study.cells("leave_one_out", **where)}
        if cells:
            lines = error_lines(
                title, {m: cells[m] for m in METHODS if m in cells}, caption="Joint angles, each frame."
            )
            figures.append(lines)
            rows += _statistics(title, lines.series, {method: cell.metrics[RMS] for method, cell in cells.items()})
    return PaperExperiment(
        name="frame_by_frame",
        title="Frame by frame: one walk and one jump (Fig. 7)",
        question=(
            "How do errors change over time? The paper plots the error of each frame of one walking and one jumping "
            "sequence for its method, local PCA and IK, without numbers."
        ),
        differences=(
            "The sequences are the first walk and the first jump of the list of clips, not those of the paper. "
            "Positions and orientations are used; the paper's choice is not known.",
            *differences(study),
        ),
        tables=(
            FindingsTable(
                "Over the frames of each sequence",
                (
                    "sequence",
                    "method",
                    "mean [deg]",
                    "RMS",
                    "95th percentile",
                    "largest",
                    f"frames where {DYNAMIC_MAP} errs less",
                ),
                tuple(rows),
            ),
        ),
        figures=tuple(figures),
        runs=("leave_one_out",),
        notes=("This is a picture: one sequence decides nothing. The experiments above test the order over units.",),
    )


def _statistics(
    title: str, series: Mapping[str, tuple[float | None, ...]], rms: Mapping[str, float | None]
) -> Iterator[tuple[str, ...]]:
    values = {method: np.array(column, dtype=float) for method, column in series.items()}
    for method, column in values.items():
        measured = column[np.isfinite(column)]
        root = rms[method]
        figures = measured.mean(), np.nan if root is None else root, np.quantile(measured, 0.95), measured.max()
        ours = values.get(DYNAMIC_MAP)
        both = np.isfinite(column) & np.isfinite(ours) if ours is not None and method != DYNAMIC_MAP else None
        below = "" if both is None or ours is None else f"{np.mean(ours[both] < column[both]):.0%}"
        yield (title, method, *(f"{figure:.2f}" for figure in figures), below)


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
        "other_approaches": ("leave_one_out", "blocks", "other_approaches"),
        "eigenmodes": (),
        "speed": (),
    },
)
