"""Where each method loses to the one with the lowest error: a sentence for the first screen, a table and a picture."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from harness.compare import MIN_UNITS, Sampling, count_units
from harness.compare.run_summary import Decomposition, DifferencePart, decompose_difference
from harness.core.number_format import format_share
from harness.report.kit.axes import draw_interval, label_rows
from harness.report.kit.body_chart import BodyGroup, draw_bodies, joint_titles
from harness.report.kit.chart import draw_chart
from harness.report.kit.page import Block, BrowserOnly, DataTable, Drawing, Stack
from harness.report.kit.style import COLOURS, FAINT, INK, MUTED, Chart, Figure
from harness.report.kit.text import to_file_name
from harness.report.run.data import Row, RunData, read_summary_only
from harness.report.run.joint_errors import BONE_ROWS
from harness.report.run.ranking import rank_groups
from harness.results import Cell

_MOST_METHODS, _MOST_READINGS = 8, 5
"""Most methods that are explained, those with the lowest errors; most states of readings in a picture."""


def decompose_losses(run: RunData, most: int = _MOST_METHODS) -> list[Decomposition]:
    """What each method loses to the one with the lowest error, that of the headline's first ranking.

    The first one is the nearest method that is worse beyond doubt, or the nearest one if there is none.
    """
    ranking = next((found for found in rank_groups(run.full_summary).values() if found), None)
    if ranking is None:
        return []
    names = sorted(list(ranking.values)[1:], key=lambda name: ranking.results[name].verdict != "better")[:most]
    reference, sampling = _cells(run, ranking.lowest), Sampling.of_summary(run.full_summary)
    found = []
    for name in names:
        pairs = ((cell, reference[what]) for what, cell in _cells(run, name).items() if what in reference)
        found.append(decompose_difference(name, ranking.lowest, pairs, sampling))
    return [each for each in found if each]


def loss_sentence(out: Path) -> str:
    """The sentence on the nearest method of the run in `out`, for a terminal; "" where nothing can be compared."""
    return " ".join(describe_loss(each) for each in decompose_losses(read_summary_only(out), 1))


def _cells(run: RunData, series: str) -> dict[tuple[str, ...], Cell]:
    def conditions(row: Row) -> tuple[str, ...]:
        return tuple(str(row[name]) for name in ("scenario", "clip", "seed", "noise"))

    return {conditions(row): run.cell(str(row["key"])) for row in run.cells if run.series_of(row) == series}


def describe_loss(loss: Decomposition) -> str:
    """Joint, phase and reading in a sentence. It says where nothing can be told."""
    whole = f"its {loss.total_deg.value:.2f}° to {loss.reference}"
    if len(loss.units) < MIN_UNITS:
        return (
            f"Where {loss.method} loses cannot be told from {count_units(loss.units)}: it takes at least {MIN_UNITS}."
        )
    if not loss.is_different:
        return f"{loss.method} cannot be told from {loss.reference}, so there is no loss to explain."
    joint, phase = loss.largest("joints"), loss.largest("phases")
    reading = loss.largest("readings") or loss.largest("statuses")
    where = [f"at the {loss.joint}" if joint else "", f"while {phase.name}" if phase else ""]
    parts = [f"{_percent(part)} of {whole} {' '.join(filter(None, where))}" for part in [phase or joint] if part]
    if reading:
        when = f"in the {format_share(reading.even_share)} of the time in which {reading.name}"
        parts.append(f"{_percent(reading)} of {'it' if parts else whole} {when}")
    if not parts:
        most = max(loss.joints, key=lambda part: part.share.value)
        parts = [f"{whole} at no single joint (most at the {most.name}: {_percent(most)})"]
    return f"Why: {loss.method} loses {', and '.join(parts)}."


def loss_blocks(losses: Sequence[Decomposition]) -> list[Block]:
    """The parts of the first difference as a picture, those of the others folded, and all in a table."""
    rows = [
        [loss.method, replace(loss.total_deg, unit=""), *(_cell(loss.largest(kind), loss, kind) for kind in _KINDS)]
        for loss in losses
    ]
    caption = (
        "Mean joint angle error beyond that of the method with the lowest, and the largest part of it: joint, phase of "
        "motion, state of a station. A part is named if its share is at least 20 %, 1.5 times that of an even "
        "spread over hinges or time, and significantly larger than that."
    )
    table = DataTable(
        ["method", "difference [deg]", *_KINDS.values()], rows, caption=caption, label="where methods lose"
    )
    drawings = [Drawing(_loss_chart(loss), level=3) for loss in losses]
    return [*drawings[:1], table, *([BrowserOnly(drawings[1:], "Pictures of the others")] if drawings[1:] else [])]


_KINDS = {"joints": "joint", "phases": "phase of motion", "readings": "reading", "statuses": "status"}
"""Kind of a part -> what it is."""


def _cell(part: DifferencePart | None, loss: Decomposition, kind: str) -> object:
    if part is None:
        return "none named"
    name = loss.joint if kind == "joints" else part.name
    return Stack(f"{name}: {_percent(part)}", f"even spread: {format_share(part.even_share)}")


def _percent(part: DifferencePart) -> str:
    return format_share(part.share.value)


def _loss_chart(loss: Decomposition) -> Chart:
    """The body with the share of each joint, and bars of all parts with the shares of an even spread."""
    readings = sorted((*loss.readings, *loss.statuses), key=lambda part: -part.share.value)[:_MOST_READINGS]
    rows = [*loss.joints, None, *loss.phases, None, *readings]
    shares = {bone: max(0.0, 100.0 * loss.bones[bone]) for bone in BONE_ROWS}
    groups = [BodyGroup("share of the difference [%]", "%", False, {loss.method: shares})]

    def draw(figure: Figure) -> None:
        left, right = cast(Any, figure.subfigures(1, 2, width_ratios=(1.0, 3.2)))
        draw_bodies(left, groups)
        axes = right.add_axes((0.0, 0.12, 0.97, 0.87))
        for row, part in enumerate(rows):
            if part:
                named = part in (loss.largest(kind) for kind in _KINDS)
                ends = (100.0 * part.share.low, 100.0 * part.share.high) if part.share.has_interval else (None, None)
                draw_interval(
                    axes, row, ends, 100.0 * part.share.value, color=COLOURS[0] if named else MUTED, marker="o"
                )
                axes.vlines(100.0 * part.even_share, row - 0.35, row + 0.35, color=INK, linewidth=1.2)
        label_rows(axes, [part.name if part else "" for part in rows])
        start = 0.03 + max(text.get_window_extent().width for text in axes.get_yticklabels()) / right.bbox.width
        axes.set_position((start, 0.12, 0.97 - start, 0.87))
        axes.axvline(0.0, color=FAINT, linewidth=0.8)
        axes.set_xlabel("share of the difference [%]")

    return draw_chart(
        f"loss_{to_file_name(loss.method)}",
        f"Where {loss.method} loses to {loss.reference}",
        f"{describe_loss(loss)} Points: share of the {loss.total_deg}, with its 95 % interval. Strokes: share of an "
        "even spread over hinges (joints) or over time (phases of motion, states of readings). Orange: named.",
        f"Shares of the difference between {loss.method} and {loss.reference} by joint, phase of motion and reading.",
        draw,
        1.0 + 0.21 * len(rows),
        layout=None,
        titles=joint_titles(groups, BONE_ROWS),
    )
