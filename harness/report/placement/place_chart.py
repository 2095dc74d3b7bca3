"""Chart of the named places on the body: `python -m harness.report.placement.place_chart FILE.png`.

docs/studies.md shows it. It needs matplotlib.
"""

import sys
from pathlib import Path

from harness.body import NAMED_PLACES
from harness.core.files import write_bytes
from harness.report.kit.chart import draw_chart
from harness.report.kit.style import COLOURS, Chart
from harness.report.placement.body_map import draw_views
from harness.report.placement.body_view import draw_station
from harness.report.placement.wording import plain_name
from harness.results.findings import CandidatePlace


def draw_place_chart() -> Chart:
    """The body from the front and from behind with all named places."""
    places = [CandidatePlace(p.name, p.bone, p.along, p.around_deg) for p in NAMED_PLACES.values()]
    texts = {place.name: place.name for place in places}
    return draw_chart(
        "places",
        "Named places",
        "Named places for stations. In the front view the body's left side is on the right.",
        f"The body with the named places: {', '.join(map(plain_name, texts))}.",
        lambda figure: draw_views(figure, places, texts, lambda axes, _, at: draw_station(axes, at, COLOURS[1])),
        4.0,
        width_in=7.4,
        layout=None,
        raster=True,
    )


def main(path: str) -> None:
    """Write the chart as a PNG."""
    write_bytes(Path(path), draw_place_chart().png)


if __name__ == "__main__":
    main(*sys.argv[1:])
