"""Chart of the named places on the body: `python -m harness.report.placement.place_chart FILE.png`.

docs/studies.md shows it. It needs matplotlib, pyvista and OpenGL.
"""

import sys
from pathlib import Path

from harness.body import NAMED_PLACES
from harness.core.files import write_bytes
from harness.errors import SystemFault
from harness.report.kit.chart import draw_chart
from harness.report.kit.style import FAINT, Chart, Figure
from harness.report.placement.body_map import label_places, render_body
from harness.report.placement.wording import plain_name
from harness.results.findings import CandidatePlace

_HEIGHT_IN = 4.6


def draw_place_chart() -> Chart:
    """The body from the front and from behind with all named places; SystemFault if it cannot be rendered."""
    places = [CandidatePlace(p.name, p.bone, p.along, p.around_deg) for p in NAMED_PLACES.values()]
    views, reason = render_body(places, {}, (0.0, 1.0))
    if views is None:
        raise SystemFault(f"The body cannot be drawn ({reason}).", "Install the extra viz, and OpenGL of the system.")
    at, pictures = views["at"], views["picture"]

    def draw(figure: Figure) -> None:
        for side, title in enumerate(("from the front", "from behind")):
            axes = figure.add_subplot(1, 2, side + 1)
            axes.imshow(pictures[side], interpolation="none")
            axes.set_axis_off()
            axes.text(0.5, 0.0, title, transform=axes.transAxes, ha="center", va="top", color=FAINT)
            visible = [n for n in range(len(places)) if (at[1, n, 2] > at[0, n, 2] + 1e-6) == bool(side)]
            label_places(axes, at[side], {n: places[n].name for n in visible}, pictures.shape[1:3])

    names = ", ".join(plain_name(place.name) for place in places)
    caption = "Named places for stations. In the front view the body's left side is on the right."
    alt = f"The body with the named places: {names}."
    return draw_chart("places", "Named places", caption, alt, draw, _HEIGHT_IN, raster=True)


def main(path: str) -> None:
    """Write the chart as a PNG."""
    write_bytes(Path(path), draw_place_chart().png)


if __name__ == "__main__":
    main(*sys.argv[1:])
