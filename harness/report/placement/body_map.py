"""The body heat map: skin coloured by what a station there is worth, from ahead and from behind, with a colour bar.

Skin takes the colour of places on its own bone alone; a bone on which nothing was tried stays grey. The body is
rendered in a process of its own; letters, lines and colour bar are drawn around it and follow the reader's screen.
"""

import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np

from harness.core.arrays import Floats
from harness.errors import MissingExtra
from harness.report.kit.render_process import describe_exit, start_renderer
from harness.report.kit.style import FAINT, INK, Chart
from harness.report.paper.line_chart import spread_positions
from harness.report.placement.wording import format_signed, plain_name
from harness.report.run.charts import draw_chart
from harness.results.placement_findings import MarginalContribution, StationNames, StationPlacement

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_COLOURS = "viridis"
_SOFTENING_M = 0.02
"""As large as a ball: nearer than this a place does not count more."""
_TIMEOUT_S = 120.0
_HEIGHT_IN, _MOST_NAMED, _GAP = 4.9, 18, 0.048
"""Of the chart; places with names, those worth most; between two names, as a share of the picture's height."""
_TOP, _ARMS, _TRUNK, _OUTER = 0.04, (0.145, 0.34), 0.12, 0.25
_NECK = 0.17
"""Shares of the picture: the first name from above, what lies above and below the arms; half of the trunk's width, and
how far from the edge hands and forearms are."""
CandidateValues = Mapping[str, float | None]
"""Candidate -> what it is worth; None where that was not measured."""


@dataclass(frozen=True)
class BodyMapValues:
    """One map: what each candidate is worth in one way of asking."""

    values: CandidateValues
    description: str
    """The same in words."""
    base: StationNames = ()
    """What is worn already: it has no value, and a dark ball."""


def draw_body_map(
    places: Sequence[StationPlacement], shown: BodyMapValues, *, unit: str, number: int = 1
) -> tuple[Chart | None, str]:
    """The chart, or None and why there is none.

    Places that have no value and are not worn are left out. Without matplotlib or pyvista, or where nothing can be
    rendered, the reason is in one line, as the report lists it.
    """
    here = [place for place in places if place.name in shown.base or shown.values.get(place.name) is not None]
    known = [value for place in here if (value := shown.values.get(place.name)) is not None]
    if not known:
        return None, "no candidate has a value"
    for package in ("matplotlib", "pyvista"):
        if find_spec(package) is None:
            return None, str(MissingExtra("A rendered picture", package, "viz"))
    low, high = min(0.0, *known), max(0.0, *known)
    ends = (low, high if high > low else low + 1.0)
    views, reason = _render(here, shown.values, ends)
    if views is None:
        return None, reason
    return _chart(here, shown, views, ends, unit, number), ""


def _render(
    places: Sequence[StationPlacement], values: CandidateValues, ends: tuple[float, float]
) -> tuple[dict[str, np.ndarray] | None, str]:
    """The pictures of both sides and where the places are on them (see `body_scene`), or why there are none."""
    from matplotlib import colormaps

    found, (low, high) = [values.get(place.name) for place in places], ends
    shares = [0.0 if value is None else (value - low) / (high - low) for value in found]
    with TemporaryDirectory(prefix="harness-report-") as folder:
        job, output = Path(folder) / "job.npz", Path(folder) / "views.npz"
        np.savez(
            job,
            bone=np.array([place.bone for place in places]),
            along=np.array([place.along for place in places]),
            around_rad=np.deg2rad([place.around_deg for place in places]),
            stand_off_m=np.zeros(len(places)),
            colour=colormaps[_COLOURS](shares)[:, :3],
            known=np.array([value is not None for value in found]),
        )
        process = start_renderer("harness.report.placement.body_map_worker", [str(job), str(output)])
        try:
            _, said = process.communicate(timeout=_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            return None, "the renderer did not finish in time"
        finally:
            if process.poll() is None:
                process.kill()
                process.communicate()
        if process.returncode != 0 or not output.exists():
            return None, describe_exit(process.returncode, said)
        with np.load(output, allow_pickle=False) as content:
            return {name: content[name] for name in content.files}, ""


def _chart(
    places: Sequence[StationPlacement],
    shown: BodyMapValues,
    views: Mapping[str, np.ndarray],
    ends: tuple[float, float],
    unit: str,
    number: int,
) -> Chart:
    values = {n: value for n, place in enumerate(places) if (value := shown.values.get(place.name)) is not None}
    order = sorted(values, key=lambda n: -values[n])
    texts = {n: f"{plain_name(places[n].name)} {format_signed(values[n])}" for n in order[:_MOST_NAMED]}
    texts |= {n: f"{plain_name(place.name)} (worn)" for n, place in enumerate(places) if n not in values}

    def draw(canvas: "Figure") -> None:
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        grid = canvas.add_gridspec(2, 2, height_ratios=(1.0, 0.035))
        at = views["at"]
        for side, title in enumerate(("from ahead", "from behind")):
            axes = canvas.add_subplot(grid[0, side])
            axes.imshow(views["picture"][side], interpolation="none")
            axes.set_axis_off()
            axes.text(0.5, 0.0, title, transform=axes.transAxes, ha="center", va="top", color=FAINT)
            here = [n for n in texts if (at[1, n, 2] > at[0, n, 2] + 1e-6) == bool(side)]
            _label_places(axes, at[side], {n: texts[n] for n in here}, views["picture"].shape[1:3])
        bar = canvas.add_subplot(grid[1, :])
        canvas.colorbar(ScalarMappable(Normalize(*ends), _COLOURS), cax=bar, orientation="horizontal")
        bar.set_xlabel(f"{shown.description} [{unit}]")
        bar.grid(False)

    most = f" Names: the {_MOST_NAMED} of {len(order)} places worth most." if len(order) > _MOST_NAMED else ""
    worn = " Dark balls: worn already." if len(values) < len(places) else ""
    named = {places[n].name: value for n, value in values.items()}
    alike = any(
        named.get(name.replace("left_", "right_", 1)) == value for name, value in named.items() if "left_" in name
    )
    pairs = " Both of a pair that is worn together have the pair's value." if alike else ""
    said = ", ".join(f"{plain_name(places[n].name)} {format_signed(values[n])}" for n in order)
    return draw_chart(
        f"body_map_{number}",
        f"{shown.description[0].upper()}{shown.description[1:]}",
        f"Balls: places that were tried, with what they are worth [{unit}]. Skin has the colour of the places on its "
        f"own bone, nearer ones more; grey bones had none.{worn}{pairs}{most} Seen from ahead, left is right.",
        f"The body coloured by {shown.description}: {said} {unit}.",
        draw,
        _HEIGHT_IN,
        raster=True,
    )


def _label_places(axes: "Axes", at: Floats, texts: Mapping[int, str], size: tuple[int, int]) -> None:
    """A name for each place with a line to its ball: over the arms, and in columns beside the rest of the body."""
    height, width = size
    for right in (False, True):
        members = [n for n in texts if bool(at[n, 0] > 0.5 * width) is right]
        inwards = {n: 0.5 - abs(float(at[n, 0]) / width - 0.5) for n in members}
        arms = [n for n in members if inwards[n] < 0.5 - _TRUNK and at[n, 1] < _ARMS[1] * height]
        ends: dict[int, tuple[float, float, bool, float]] = {}
        """How far from the edge of the picture, how far down, whether it begins there, where in it its line begins."""
        for k, n in enumerate(sorted(arms, key=lambda n: -inwards[n])):
            down, outer = _ARMS[0] - _GAP * k, inwards[n] < _OUTER
            ends[n] = (
                (max(inwards[n] - 0.05, 0.01), down, True, 0.12) if outer else (inwards[n] + 0.09, down, False, 0.7)
            )
        rest = sorted((n for n in members if n not in arms), key=lambda n: (at[n, 1], at[n, 0]))
        above = [n for n in rest if at[n, 1] < _NECK * height]
        below = [n for n in rest if n not in above]
        highest = min([_TOP, *(down - _GAP for _, down, *_ in ends.values())])
        wanted = [max(float(at[n, 1]) / height, _ARMS[1] + _GAP * k) for k, n in enumerate(below)]
        heights = [highest - _GAP * k for k in range(len(above))][::-1] + spread_positions(wanted, _GAP)
        ends |= {n: (0.01, down, True, 1.0) for n, down in zip((*above, *below), heights, strict=True)}
        for n, (across, down, begins, start) in ends.items():
            axes.annotate(
                texts[n],
                (float(at[n, 0]), float(at[n, 1])),
                ((1.0 - across if right else across) * width, down * height),
                arrowprops={
                    "arrowstyle": "-",
                    "color": FAINT,
                    "linewidth": 0.8,
                    "shrinkA": 1.0,
                    "shrinkB": 5.0,
                    "relpos": (1.0 - start if right else start, 0.0 if n in arms else 0.5),
                },
                ha="right" if right is begins else "left",
                va="center",
                fontsize=8.5,
                color=INK,
                annotation_clip=False,
            )


def interpolate_colours(points_m: Floats, places_m: Floats, colours: Floats) -> Floats:
    """(P, 3) colours of points on a skin (P, 3) [m], of places on it (N, 3) that have colours (N, 3): nearer places
    count more, by the inverse square of the distance (Shepard 1968, Proc. ACM National Conference)."""
    gap_m = np.linalg.norm(points_m[:, None] - places_m, axis=2)
    weight = 1.0 / (gap_m**2 + _SOFTENING_M**2)
    out: Floats = (weight / weight.sum(axis=1, keepdims=True)) @ colours
    return out


def select_body_maps(worth: Sequence[MarginalContribution]) -> list[BodyMapValues]:
    """What there is to show: candidates among each other, as many as can be, and what one more is worth."""
    groups: dict[tuple[str, StationNames], dict[str, float | None]] = {}
    for each in worth:
        groups.setdefault((each.mode, each.base), {})[each.candidate] = each.difference
    words = {
        "ablate": "error without it, of {count} trackers, less error with it",
        "add": "what one more takes off the error",
        "exhaustive": "error of sets without it less error of sets with it, on average",
    }
    found = [
        BodyMapValues(values, words[mode].format(count=len(base)), base if mode == "add" else ())
        for (mode, base), values in sorted(groups.items(), key=lambda group: group[0][0] != "exhaustive")
        if any(value is not None for value in values.values())
    ]
    among, more = [one for one in found if not one.base], [one for one in found if one.base]
    return [max(kind, key=lambda one: len(one.values)) for kind in (among, more) if kind]
