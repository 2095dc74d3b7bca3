"""The look of charts: ink, grid and colours that the colour-blind can distinguish, on light and dark screens."""

import io
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure as Figure
else:
    Axes = Figure = Any  # names for annotations: the import of matplotlib takes long

INK, FAINT, GRID, PAPER = "#23282f", "#6b7480", "#dfe3e8", "#fefefe"
_DARK = {INK: "#e4e7eb", FAINT: "#9aa4b0", GRID: "#343b45", PAPER: "#14171b"}
COLOURS = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
"""Okabe & Ito 2008, Color Universal Design, without yellow, which is hardly visible on white. Each is used once."""
DASHES: tuple[Any, ...] = ("solid", (0, (4, 1.5)), (0, (1, 1)), (0, (6, 1.5, 1, 1.5)))
"""Dashes of lines, in the order of their use."""
MARKERS = ("o", "s", "^", "D", "v", "P", "X")
"""Markers of series, in the order of their use."""
MUTED = "#98a1ab"
"""Grey of series that have no colour: those behind highlighted ones, and those beyond the last colour."""
STYLES = len(DASHES) * (1 + len(MARKERS))
"""Number of grey lines that can be told apart."""
SETTINGS: dict[Any, Any] = {
    "font.family": "sans-serif",
    "font.size": 10.0,
    "text.parse_math": False,  # names are shown as they are, dollar signs too
    "text.color": INK,
    "axes.edgecolor": FAINT,
    "axes.labelcolor": INK,
    "axes.titlesize": 10.0,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.facecolor": "none",
    "figure.facecolor": "none",
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "xtick.color": FAINT,
    "ytick.color": FAINT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "lines.linewidth": 1.4,
    "svg.fonttype": "none",
    "path.simplify_threshold": 0.5,
}
"""Settings for `matplotlib.rc_context` while a chart is drawn; none of them stays set."""
PRINT_SETTINGS: dict[Any, Any] = {
    **SETTINGS,
    "font.family": "DejaVu Sans",  # comes with matplotlib, so that every machine writes the same bytes
    "font.size": 8.0,
    "axes.titlesize": 7.5,
    "axes.titleweight": "normal",
    "axes.labelsize": 7.5,
    "axes.linewidth": 0.6,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "legend.fontsize": 7.0,
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.1,
    "hatch.linewidth": 0.5,
    "pdf.fonttype": 42,  # TrueType, which journals ask for; matplotlib's default is Type 3
    "svg.fonttype": "path",  # looks the same on a machine without the font
}
"""Settings of figures for papers: text of 7 to 8 pt at the final size, fonts in the file."""
_PLACES, _DECIMALS = re.compile(r'\b(?:d|x|y)="[^"]*"|translate\([^)]*\)'), re.compile(r"(\.\d\d)\d+")
"""Coordinates of an SVG, and numbers with more than two decimals."""
_NOTE_SHARE = 0.95


@dataclass(frozen=True)
class Chart:
    """A finished chart."""

    name: str
    """File name without its suffix."""
    title: str
    caption: str
    alt: str
    """Alternative text: what the chart shows, for readers who cannot see it."""
    svg: str
    png: bytes = b""
    """The chart on white as PNG; empty unless `draw_chart` was called with `raster`."""
    lines: Mapping[str, Any] | None = None
    """Names and scales for `hover_chart.js`; None for a chart whose lines have no values under the pointer."""
    titles: Mapping[str, str] = field(default_factory=dict)
    """Gid of an element -> text under the pointer."""

    def write(self, folder: Path) -> None:
        """Write FOLDER/name.svg, and FOLDER/name.png if there is a PNG."""
        (folder / f"{self.name}.svg").write_text(self.svg, encoding="utf-8")
        if self.png:
            (folder / f"{self.name}.png").write_bytes(self.png)

    def for_screen(self) -> str:
        """The SVG with colours of ink and grid that follow the reader's light or dark screen, rounded to 0.01 pt."""
        text, light, dark = _PLACES.sub(lambda match: _DECIMALS.sub(r"\1", match[0]), self.svg), "", ""
        for n, (colour, on_dark) in enumerate(_DARK.items()):
            text = text.replace(colour, f"var(--c{n})")
            light += f"--c{n}:{colour};"
            dark += f"--c{n}:{on_dark};"
        text = re.sub(r"(font:[^;\"']*?px|font-family:) [^;\"]*", r"\1 system-ui, sans-serif", text)
        text = re.sub(r' transform="rotate\(-0 [^)]*\)"|(?<=\n) +', "", text)
        rules = f"svg{{{light}}}@media screen and (prefers-color-scheme: dark){{svg{{{dark}}}}}"
        return text.replace("<defs>", f"<style>{rules}</style><defs>", 1)


def to_svg(figure: Figure, name: str, settings: dict[Any, Any] = SETTINGS) -> str:
    """The figure as SVG text; the same figure gives the same bytes."""
    import matplotlib

    file = io.StringIO()
    with matplotlib.rc_context({**settings, "svg.hashsalt": name}):
        figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None})
    return file.getvalue()


def to_png(figure: Figure, dpi: int = 130) -> bytes:
    """The figure as PNG on white; the same figure gives the same bytes."""
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=dpi, facecolor="white", metadata={"Software": None})
    return file.getvalue()


def to_pdf(figure: Figure) -> bytes:
    """The figure as PDF with its fonts; the same figure gives the same bytes."""
    import matplotlib

    file = io.BytesIO()
    with matplotlib.rc_context(PRINT_SETTINGS):
        figure.savefig(file, format="pdf", metadata=dict.fromkeys(("CreationDate", "Creator", "Producer")))
    return file.getvalue()


def note_size() -> float:
    """Size of notes inside a chart [pt], a little smaller than its text; inside `rc_context` only."""
    import matplotlib

    return _NOTE_SHARE * float(matplotlib.rcParams["font.size"])


def mark_scale() -> float:
    """Size of markers and offsets relative to those of pages, which have text of 10 pt; inside `rc_context` only."""
    import matplotlib

    return float(matplotlib.rcParams["font.size"]) / float(SETTINGS["font.size"])


def legend_scale() -> float:
    """Size of the text of legends relative to that of pages; inside `rc_context` only."""
    import matplotlib
    from matplotlib.font_manager import FontProperties

    size = FontProperties(size=matplotlib.rcParams["legend.fontsize"]).get_size_in_points()
    return float(size) / float(SETTINGS["font.size"])


def series_colour(n: int) -> str:
    """Colour of the n-th series: each colour is used once, and the series beyond the last one are grey."""
    return COLOURS[n] if n < len(COLOURS) else MUTED


def series_style(n: int) -> dict[str, Any]:
    """Colour, dashes and marker of the n-th series: coloured lines are solid, and grey ones differ in their dashes."""
    return {**print_line_style(n), **({"linestyle": DASHES[0]} if n < len(COLOURS) else {})}


def print_line_style(n: int) -> dict[str, Any]:
    """Colour, dashes and marker of the n-th series in print: neighbours differ in all of them, also without colour."""
    return {
        "color": series_colour(n),
        "linestyle": DASHES[n % len(DASHES)],
        "marker": MARKERS[(n + n // len(DASHES)) % len(MARKERS)],
    }


def muted_line_style(n: int) -> dict[str, Any]:
    """Dashes and marker of the n-th grey series behind highlighted ones; the first four have no marker."""
    marker = (None, *MARKERS)[n // len(DASHES) % (1 + len(MARKERS))]
    return {"color": MUTED, "linestyle": DASHES[n % len(DASHES)], "marker": marker}


def hide_frame(axes: Axes) -> None:
    """Hide frame, grid and ticks of axes whose rows are labelled bands."""
    axes.grid(False)
    axes.tick_params(length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)
