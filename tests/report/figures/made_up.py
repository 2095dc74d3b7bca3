"""Runs for figures and tables: rows alone where no frames are drawn, and fabricated frames where they are."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import matplotlib
from matplotlib.collections import Collection, LineCollection
from matplotlib.figure import Figure

from harness.report.figures.print_figure import MM_PER_IN, PrintFigure
from harness.report.kit.style import PRINT_SETTINGS
from harness.results.reader import ResultSet
from tests.compare.sides import cell, manifest, side, write_run

CLIPS = 15
TWIN = [0.96 if n % 2 else 1.05 for n in range(CLIPS)]
"""Factors of a method that is now better, now worse than the one with factor 1."""
METHODS: dict[str, float | list[float]] = {"expert_map": 1.0, "twin_map": TWIN, "ik": 1.5, "mean_pose": 4.0}
"""`twin_map` is tied with `expert_map`, the others are worse."""


def ranked_run(out: Path, clips: int = CLIPS) -> Path:
    """A run of one condition with METHODS; rows alone."""
    methods = {name: times[:clips] if isinstance(times, list) else times for name, times in METHODS.items()}
    return write_run(out, side(methods=methods, clips=clips))


def conditions_run(out: Path) -> Path:
    """Two noise presets, known and new performers, two behaviours; rows alone."""
    cells = []
    for number, noise in enumerate(("clean", "default"), start=1):
        for performer, clips in (("known", 8), ("new", 3)):
            for n in range(clips):
                for method, times in (("ik", 2.0), ("expert_map", 1.0)):
                    fields = {"noise": noise, "varied": {"noise": noise}, "performer": performer}
                    behaviour = "walking" if n % 2 else "boxing"
                    clip = f"{performer}_{n:02}"
                    cells.append(cell(clip, method, number * times, behaviour=behaviour, **fields))
    return write_run(out, ResultSet("A", manifest(), tuple(cells), len(cells)))


def spans(collections: Iterable[Collection], axis: int) -> list[tuple[float, float]]:
    """The ends of the first line of each collection, as `hlines` (axis 0) and `vlines` (axis 1) draw them."""
    found = []
    for collection in collections:
        assert isinstance(collection, LineCollection)
        start, end = collection.get_segments()[0][:, axis]
        found.append((float(start), float(end)))
    return found


@contextmanager
def drawn(figure: PrintFigure, width_mm: int = 85) -> Iterator[Figure]:
    """The figure as it is written to a file, for looks at its parts."""
    with matplotlib.rc_context(PRINT_SETTINGS):
        made = Figure(figsize=(width_mm / MM_PER_IN, figure.height_mm / MM_PER_IN), layout="constrained")
        figure.draw(made)
        made.draw_without_rendering()
        yield made
