"""Liu et al. 2011, Fig. 7: the error of each frame of one walk and one jump."""

from collections.abc import Iterator, Mapping

import numpy as np

from harness.results.findings import FindingsTable, LineChart, PaperExperiment
from harness.study.papers.leave_one_out import DYNAMIC_MAP, METHODS, differences
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.tables import RMS, error_lines

RUN, INPUTS = "leave_one_out", "pos+ori"


def frame_by_frame(study: PaperStudy) -> PaperExperiment:
    """Errors over time of the first walk and the first jump that the scenario lists, chosen before any run."""
    rows: list[tuple[str, ...]] = []
    figures: list[LineChart] = []
    for behaviour in ("walking", "jumping"):
        motion = study.runs[RUN].motion
        where = {"behaviour": behaviour, "inputs": INPUTS, "clip": motion.test[motion.behaviours.index(behaviour)]}
        title = f"{behaviour}, {where['clip']}"
        cells = {cell.method: cell for _, cell in study.cells(RUN, **where)}
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
        runs=(RUN,),
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
