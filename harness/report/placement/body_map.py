"""The body map: skin coloured by the contribution of a station there, from the front and from behind.

Skin takes the colour of places on its own bone only; a bone on which no place was tried stays grey. The body is
rendered in a separate process. Labels, lines and colour bar are drawn around it and follow the reader's screen colours.
"""

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from harness.core.arrays import Floats
from harness.core.number_format import format_fixed
from harness.core.progress import report_step
from harness.core.working_folder import plain_import
from harness.errors import MissingExtra
from harness.report.kit.chart import draw_chart, spread_positions
from harness.report.kit.render_process import finish_renderer, start_renderer
from harness.report.kit.style import FAINT, INK, Axes, Chart, Figure
from harness.report.placement.wording import plain_name
from harness.results.findings import CandidatePlace, MarginalContribution, StationNames

_COLOURS = "viridis"
_SOFTENING_M = 0.02
"""Radius of a ball [m]; within this distance the weight of a place hardly grows."""
_TIMEOUT_S = 120.0
"""Time allowed for rendering [s]."""
_HEIGHT_IN, _MOST_NAMED, _GAP = 4.9, 18, 0.048
"""Height of the chart [in]; most places with names, those with the largest contributions; distance of two names, as a
share of the picture's height."""
_TOP, _ARMS, _TRUNK, _OUTER = 0.04, (0.145, 0.34), 0.12, 0.25
_NECK = 0.17
"""Shares of the picture: height of the first name; limits of the arms' height; half of the trunk's width; distance of
hands and forearms from the edge; height of the neck."""
CandidateValues = Mapping[str, float | None]
"""Candidate -> its contribution; None where it was not measured."""


def draw_body_map(
    places: Sequence[CandidatePlace],
    values: CandidateValues,
    description: str,
    base: StationNames = (),
    *,
    unit: str,
    number: int = 1,
) -> tuple[Chart | None, str]:
    """The chart and "", or None and the reason in one line why there is none.

    `values` are contributions of candidates, measured in one way, which `description` says in words. Stations of `base`
    are already worn: they have no value and are drawn as dark balls.

    Places that have no value and are not worn are left out. The chart needs pyvista and OpenGL.
    """
    shown_places = [place for place in places if place.name in base or values.get(place.name) is not None]
    measured = [value for place in shown_places if (value := values.get(place.name)) is not None]
    if not measured:
        return None, "no candidate has a value"
    if find_spec("pyvista") is None:
        return None, str(MissingExtra("A rendered picture", "pyvista", "viz"))
    low, high = min(0.0, *measured), max(0.0, *measured)
    ends = (low, high if high > low else low + 1.0)
    views, reason = render_body(shown_places, values, ends)
    if views is None:
        return None, reason
    return _chart(shown_places, values, description, views, ends, unit, number), ""


def render_body(
    places: Sequence[CandidatePlace], values: CandidateValues, ends: tuple[float, float]
) -> tuple[dict[str, np.ndarray] | None, str]:
    """Pictures of both sides and the places on them (see `body_map_worker.main`), or None and the reason."""
    report_step("rendered body")
    with plain_import():
        from matplotlib import colormaps

    contributions, (low, high) = [values.get(place.name) for place in places], ends
    shares = [0.0 if value is None else (value - low) / (high - low) for value in contributions]
    with TemporaryDirectory(prefix="harness-report-") as folder:
        job, output = Path(folder) / "job.npz", Path(folder) / "views.npz"
        np.savez(
            job,
            bone=np.array([place.bone for place in places]),
            along=np.array([place.along for place in places]),
            around_rad=np.deg2rad([place.around_deg for place in places]),
            stand_off_m=np.zeros(len(places)),
            colour=colormaps[_COLOURS](shares)[:, :3],
            known=np.array([value is not None for value in contributions]),
        )
        with start_renderer("harness.report.placement.body_map_worker", [str(job), str(output)]) as process:
            reason = finish_renderer(process, _TIMEOUT_S)
        if reason or not output.exists():
            return None, reason or "the renderer wrote no picture"
        with np.load(output, allow_pickle=False) as content:
            return {name: content[name] for name in content.files}, ""


def _chart(
    places: Sequence[CandidatePlace],
    known: CandidateValues,
    description: str,
    views: Mapping[str, np.ndarray],
    ends: tuple[float, float],
    unit: str,
    number: int,
) -> Chart:
    values = {n: value for n, place in enumerate(places) if (value := known.get(place.name)) is not None}
    order = sorted(values, key=lambda n: -values[n])
    texts = {n: f"{plain_name(places[n].name)} {format_fixed(values[n], 2, signed=True)}" for n in order[:_MOST_NAMED]}
    texts |= {n: f"{plain_name(place.name)} (worn)" for n, place in enumerate(places) if n not in values}

    def draw(figure: Figure) -> None:
        from matplotlib.cm import ScalarMappable
        from matplotlib.colors import Normalize

        grid = figure.add_gridspec(2, 2, height_ratios=(1.0, 0.035))
        at = views["at"]
        for side, title in enumerate(("from the front", "from behind")):
            axes = figure.add_subplot(grid[0, side])
            axes.imshow(views["picture"][side], interpolation="none")
            axes.set_axis_off()
            axes.text(0.5, 0.0, title, transform=axes.transAxes, ha="center", va="top", color=FAINT)
            visible = [n for n in texts if (at[1, n, 2] > at[0, n, 2] + 1e-6) == bool(side)]
            label_places(axes, at[side], {n: texts[n] for n in visible}, views["picture"].shape[1:3])
        bar = figure.add_subplot(grid[1, :])
        figure.colorbar(ScalarMappable(Normalize(*ends), _COLOURS), cax=bar, orientation="horizontal")
        bar.set_xlabel(f"{description} [{unit}]")
        bar.grid(False)

    most = (
        f" Named: the {_MOST_NAMED} of {len(order)} places with the largest contributions."
        if len(order) > _MOST_NAMED
        else ""
    )
    worn = " Dark balls: stations that are already worn." if len(values) < len(places) else ""
    named = {places[n].name: value for n, value in values.items()}
    has_pairs = any(
        named.get(name.replace("left_", "right_", 1)) == value for name, value in named.items() if "left_" in name
    )
    pairs = " Both stations of a pair that is worn together have the pair's value." if has_pairs else ""
    contributions = ", ".join(f"{plain_name(places[n].name)} {format_fixed(values[n], 2, signed=True)}" for n in order)
    return draw_chart(
        f"body_map_{number}",
        f"{description[0].upper()}{description[1:]}",
        f"Balls: places that were tried, with their contribution [{unit}]. Skin has the colour of the places on its "
        f"own bone, weighted by distance; no place was tried on grey bones.{worn}{pairs}{most} In the front view the "
        "body's left side is on the right.",
        f"The body coloured by {description}: {contributions} {unit}.",
        draw,
        _HEIGHT_IN,
        raster=True,
    )


def label_places(axes: Axes, at: Floats, texts: Mapping[int, str], size: tuple[int, int]) -> None:
    """Write a name with a line to its ball for each place: above the arms, and in columns next to the rest."""
    height, width = size
    for right in (False, True):
        members = [n for n in texts if bool(at[n, 0] > 0.5 * width) is right]
        inwards = {n: 0.5 - abs(float(at[n, 0]) / width - 0.5) for n in members}
        arms = [n for n in members if inwards[n] < 0.5 - _TRUNK and at[n, 1] < _ARMS[1] * height]
        ends: dict[int, tuple[float, float, bool, float]] = {}
        # Place -> distance from the edge of the picture, height, whether the name starts there, start of its line.
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
                fontsize=9.5,
                color=INK,
                annotation_clip=False,
            )


def interpolate_colours(points_m: Floats, places_m: Floats, colours: Floats) -> Floats:
    """(P, 3) colours of skin points (P, 3) [m], interpolated from places (N, 3) [m] with colours (N, 3).

    Weights are inverse squares of the distance (Shepard 1968, Proc. ACM National Conference).
    """
    distance_m = np.linalg.norm(points_m[:, None] - places_m, axis=2)
    weight = 1.0 / (distance_m**2 + _SOFTENING_M**2)
    out: Floats = (weight / weight.sum(axis=1, keepdims=True)) @ colours
    return out


def select_body_maps(contributions: Sequence[MarginalContribution]) -> list[tuple[CandidateValues, str, StationNames]]:
    """The values, the description and the worn stations of each map to draw.

    One compares candidates with each other, and one is of adding a station, if there are any.
    """
    groups: dict[tuple[str, StationNames], dict[str, float | None]] = {}
    for contribution in contributions:
        group = groups.setdefault((contribution.mode, contribution.base), {})
        group[contribution.candidate] = contribution.difference
    words = {
        "ablate": "error without it minus error with all {count} stations",
        "add": "reduction of the error by one more station",
        "exhaustive": "mean error of sets without it minus mean error of sets with it",
    }
    maps = [
        (values, words[mode].format(count=len(base)), base if mode == "add" else ())
        for (mode, base), values in sorted(groups.items(), key=lambda group: group[0][0] != "exhaustive")
        if any(value is not None for value in values.values())
    ]
    kinds = [each for each in maps if not each[2]], [each for each in maps if each[2]]
    return [max(kind, key=lambda each: len(each[0])) for kind in kinds if kind]
