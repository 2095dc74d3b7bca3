"""Makes up the content of a coverage page."""

import numpy as np

from harness.report.coverage.content import CoverageContent, CoverageRow, PlanView, StationRow

EMITTER_M = np.array([[x, y, 0.0] for x in (-1.0, 0.0, 1.0) for y in (-0.6, 0.0, 0.6)])


def fabricate_coverage(name: str = "attic", *, stations: bool = True) -> CoverageContent:
    """Three plan views of 31 x 21 places; the dilution is NaN outside a disc."""
    x_m, y_m = np.linspace(-3.0, 3.0, 31), np.linspace(-2.0, 2.0, 21)
    radius_m = np.hypot(*np.meshgrid(x_m, y_m, indexing="ij"))
    dilution = np.where(radius_m < 1.8, 0.7 + radius_m, np.nan)
    heard = np.clip(9 - 4 * radius_m, 0, None).astype(np.int64)
    rows = [
        StationRow("left_hand", (0.0, 0.0, 0.1, 0.9), 0.85, 1.5),
        StationRow("<b>torso</b>", (0.25, 0.25, 0.25, 0.25), 0.2, float("nan")),
    ]
    return CoverageContent(
        name=name,
        emitters="9 emitters on 2.00 x 1.20 x 0.00 m",
        reach="4 m within 70 deg of each axis",
        turn="0.113 s for a turn of all emitters",
        emitter_m=EMITTER_M,
        half_m=1.0,
        views=[PlanView(height_m, x_m, y_m, heard, dilution) for height_m in (0.3, 1.0, 1.7)],
        rows=[CoverageRow("0 to 2 m", 0.9, 0.8, 6.0, 1.25), CoverageRow("1.7 m", 0.5, 0.0, 2.0, float("nan"))],
        clip="golf_p1_01" if stations else "",
        stations=rows if stations else (),
        command="harness inspect attic.mcf",
    )
