"""The look of charts: ink, grid and colours that the colour-blind can distinguish, on light and dark screens."""

import io
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, FAINT, GRID, PAPER = "#23282f", "#6b7480", "#dfe3e8", "#fefefe"
_DARK = {INK: "#e4e7eb", FAINT: "#9aa4b0", GRID: "#343b45", PAPER: "#14171b"}
COLOURS = ("#d55e00", "#0072b2", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", FAINT)
"""Okabe & Ito 2008, Color Universal Design, without yellow, which is hardly visible on white."""
DASHES: tuple[Any, ...] = ("solid", (0, (4, 1.5)), (0, (1, 1)), (0, (6, 1.5, 1, 1.5)))
"""Line styles; the next one is used each time all colours have been used."""
STYLES = len(COLOURS) * len(DASHES)
"""Number of lines that can be told apart."""
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

    def write(self, folder: Path) -> None:
        """Write FOLDER/name.svg, and FOLDER/name.png if there is a PNG."""
        (folder / f"{self.name}.svg").write_text(self.svg, encoding="utf-8")
        if self.png:
            (folder / f"{self.name}.png").write_bytes(self.png)

    def for_screen(self) -> str:
        """The SVG with colours of ink and grid that follow the reader's light or dark screen."""
        text, light, dark = self.svg, "", ""
        for n, (colour, on_dark) in enumerate(_DARK.items()):
            text = text.replace(colour, f"var(--c{n})")
            light += f"--c{n}:{colour};"
            dark += f"--c{n}:{on_dark};"
        text = re.sub(r"(font:[^;\"']*?px) [^;\"]*", r"\1 system-ui, sans-serif", text)
        rules = f"svg{{{light}}}@media (prefers-color-scheme: dark){{svg{{{dark}}}}}"
        return text.replace("<defs>", f"<style>{rules}</style><defs>", 1)


def to_svg(figure: "Figure", name: str) -> str:
    """The figure as SVG text; the same figure gives the same bytes."""
    import matplotlib

    file = io.StringIO()
    with matplotlib.rc_context({**SETTINGS, "svg.hashsalt": name}):
        figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None})
    return file.getvalue()


def to_png(figure: "Figure") -> bytes:
    """The figure as PNG on white; the same figure gives the same bytes."""
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=130, facecolor="white", metadata={"Software": None})
    return file.getvalue()


def line_style(n: int) -> dict[str, Any]:
    """Colour and dashes of the n-th series."""
    return {
        "color": COLOURS[n % len(COLOURS)],
        "linestyle": DASHES[n // len(COLOURS) % len(DASHES)],
    }


def hide_frame(axes: "Axes") -> None:
    """Hide frame, grid and ticks of axes whose rows are labelled bands."""
    axes.grid(False)
    axes.tick_params(length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)
