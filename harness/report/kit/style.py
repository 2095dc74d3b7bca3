"""How charts look: one ink, one grid, colours that the colour-blind can tell apart, for light and for dark screens."""

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
"""Okabe & Ito 2008, Color Universal Design, without the yellow that paper swallows."""
DASHES: tuple[Any, ...] = ("solid", (0, (4, 1.5)), (0, (1, 1)), (0, (6, 1.5, 1, 1.5)))
"""Change after every round of colours."""
STYLES = len(COLOURS) * len(DASHES)
"""Lines that look different."""
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
"""Given to `matplotlib.rc_context` while a chart is made; nothing stays set."""


@dataclass(frozen=True)
class Chart:
    """A finished chart."""

    name: str
    """Of the file, without ending."""
    title: str
    caption: str
    alt: str
    """What it shows, for those who cannot see it."""
    svg: str
    png: bytes = b""
    """The same on white, where one was asked for."""

    def write(self, folder: Path) -> None:
        """As an SVG that any program opens, and the PNG if there is one."""
        (folder / f"{self.name}.svg").write_text(self.svg, encoding="utf-8")
        if self.png:
            (folder / f"{self.name}.png").write_bytes(self.png)

    def for_screen(self) -> str:
        """The SVG with ink and grid that follow the reader's light or dark screen."""
        text, light, dark = self.svg, "", ""
        for n, (colour, on_dark) in enumerate(_DARK.items()):
            text = text.replace(colour, f"var(--c{n})")
            light += f"--c{n}:{colour};"
            dark += f"--c{n}:{on_dark};"
        text = re.sub(r"(font:[^;\"']*?px) [^;\"]*", r"\1 system-ui, sans-serif", text)
        rules = f"svg{{{light}}}@media (prefers-color-scheme: dark){{svg{{{dark}}}}}"
        return text.replace("<defs>", f"<style>{rules}</style><defs>", 1)


def to_svg(figure: "Figure", name: str) -> str:
    """The drawing as SVG text; the same figure gives the same bytes."""
    import matplotlib

    file = io.StringIO()
    with matplotlib.rc_context({**SETTINGS, "svg.hashsalt": name}):
        figure.savefig(file, format="svg", metadata={"Date": None, "Creator": None})
    return file.getvalue()


def to_png(figure: "Figure") -> bytes:
    """The drawing as a picture on white; the same figure gives the same bytes."""
    file = io.BytesIO()
    figure.savefig(file, format="png", dpi=130, facecolor="white", metadata={"Software": None})
    return file.getvalue()


def line_style(place: int) -> dict[str, Any]:
    """Colour and dashes of the n-th series."""
    return {
        "color": COLOURS[place % len(COLOURS)],
        "linestyle": DASHES[place // len(COLOURS) % len(DASHES)],
    }


def hide_frame(axes: "Axes") -> None:
    """No frame, no grid, no ticks on the left: for bands that are read by name."""
    axes.grid(False)
    axes.tick_params(length=0)
    for spine in axes.spines.values():
        spine.set_visible(False)
