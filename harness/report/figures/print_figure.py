"""Figures for papers: what is chosen of a run, and files as wide as a column or a page, with the same bytes always."""

from collections.abc import Callable
from dataclasses import dataclass

from harness.core.working_folder import plain_import
from harness.errors import BadInput, UnknownName
from harness.report.kit.style import PRINT_SETTINGS, Figure, to_pdf, to_png, to_svg
from harness.results import PRIMARY_METRIC

FORMATS = ("pdf", "svg", "png")
WIDTHS_MM = (85, 170)
"""Widths of one and of two columns of a journal page [mm]."""
MM_PER_IN = 25.4
_MOST_HIGH_MM = 240.0
"""Height of a journal page [mm]."""
_PNG_DPI = 300


@dataclass(frozen=True)
class PrintFigure:
    """A figure for a paper that is not drawn yet."""

    name: str
    """File name without its suffix."""
    caption: str
    """Sentences for the caption: what is shown, on how many clips, and what the marks mean."""
    draw: Callable[[Figure], None]
    """Draws on an empty figure; its width is that of the paper, and its height may be changed."""
    height_mm: float


def draw_figure(figure: PrintFigure, fmt: str, width_mm: int) -> tuple[bytes, float]:
    """Draw a figure in one of FORMATS at one of WIDTHS_MM; the content of its file, and its height in print [mm].

    UnknownName for another format, BadInput for another width and for a figure that is higher than a page.
    """
    if fmt not in FORMATS:
        raise UnknownName("format of figures", fmt, FORMATS)
    if width_mm not in WIDTHS_MM:
        raise BadInput(f"A figure {width_mm} mm wide.", f"Choose {' or '.join(map(str, WIDTHS_MM))} mm.")
    with plain_import():
        import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(PRINT_SETTINGS):
        drawn = Figure(figsize=(width_mm / MM_PER_IN, figure.height_mm / MM_PER_IN), layout="constrained")
        figure.draw(drawn)
        height_mm = drawn.get_figheight() * MM_PER_IN
        if height_mm > _MOST_HIGH_MM:
            advice = f"A page has {_MOST_HIGH_MM:.0f} mm. Show fewer methods (--methods) or conditions (--condition)."
            raise BadInput(f"The figure would be {height_mm:.0f} mm high.", advice)
        if fmt == "svg":
            return to_svg(drawn, figure.name, PRINT_SETTINGS).encode(), height_mm
        return to_pdf(drawn) if fmt == "pdf" else to_png(drawn, _PNG_DPI), height_mm


@dataclass(frozen=True)
class FigureSelection:
    """What the user chose; the defaults leave the choice to the figure."""

    metric: str = PRIMARY_METRIC
    methods: tuple[str, ...] = ()
    """Methods to show, in this order where order matters; empty: all."""
    condition: str = ""
    """Name of a condition or some of its parts (see `RunCondition.name`); empty: all, or the last setting."""
    clip: str = ""
    control: str = ""
    """The method that is highlighted next to the one with the lowest error."""
