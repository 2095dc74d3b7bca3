"""Figures for papers: size in print, fonts in the file, text of 7 to 8 pt, the same bytes each time."""

import io
import itertools
import re
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.text import Text
from PIL import Image

from harness.errors import BadInput, UnknownName
from harness.report.figures.print_figure import FORMATS, WIDTHS_MM, PrintFigure, draw_figure
from harness.report.kit.chart import add_legend
from harness.report.kit.style import COLOURS, MARKERS, MUTED, muted_line_style, print_line_style
from tests.report.figures.made_up import drawn


def _draw(figure: Figure) -> None:
    axes = figure.subplots()
    for n in range(3):
        axes.plot([0.0, 1.0], [n, 1.0], label=f"method_{n} $x", **print_line_style(n))
    axes.set_xlabel("time [s]")
    add_legend(figure, axes)


FIGURE = PrintFigure("lines", "Three lines.", _draw, 50.0)
PROGRAM = """
import hashlib
from tests.report.figures.test_print_figure import FIGURE, FORMATS, draw_figure
for fmt in FORMATS:
    print(hashlib.sha256(draw_figure(FIGURE, fmt, 85)[0]).hexdigest())
"""


def page_mm(data: bytes) -> tuple[float, ...]:
    """Width and height of the page of a PDF file."""
    (box,) = re.findall(rb"/MediaBox \[ 0 0 ([\d.]+) ([\d.]+) \]", data)
    return tuple(float(points) / 72.0 * 25.4 for points in box)


@pytest.mark.parametrize("width_mm", WIDTHS_MM)
def test_every_format_has_the_size_that_is_asked_for(width_mm: int) -> None:
    figures = {fmt: draw_figure(FIGURE, fmt, width_mm) for fmt in FORMATS}
    for _, height_mm in figures.values():
        assert height_mm == pytest.approx(50.0, abs=6.0)
    size = (width_mm, figures["pdf"][1])
    assert page_mm(figures["pdf"][0]) == pytest.approx(size, abs=0.01)
    (points,) = re.findall(r'<svg [^>]*width="([\d.]+)pt" height="([\d.]+)pt"', figures["svg"][0].decode())
    assert [float(each) / 72.0 * 25.4 for each in points] == pytest.approx(size, abs=0.01)
    with Image.open(io.BytesIO(figures["png"][0])) as image:
        assert image.info["dpi"] == pytest.approx((300.0, 300.0), abs=0.1)
        assert [pixels / 300.0 * 25.4 for pixels in image.size] == pytest.approx(size, abs=0.1)


def test_a_pdf_holds_truetype_fonts() -> None:
    data = draw_figure(FIGURE, "pdf", 85)[0]
    assert b"/Subtype /Type3" not in data
    fonts = re.findall(rb"/Subtype /CIDFontType2", data)
    assert 0 < len(fonts) == len(re.findall(rb"/FontFile2", data))


def test_an_svg_needs_no_font() -> None:
    text = draw_figure(FIGURE, "svg", 85)[0].decode()
    assert "<text" not in text
    assert "font-family" not in text
    assert "<!-- method_0 $x -->" in text  # what the paths are, for readers of the file


def test_a_png_is_on_white() -> None:
    pixels = imread(io.BytesIO(draw_figure(FIGURE, "png", 85)[0]))
    np.testing.assert_array_equal(pixels[0, 0], 1.0)


def test_text_has_seven_to_eight_points() -> None:
    with drawn(FIGURE) as figure:
        sizes = {
            float(text.get_fontsize()) for text in figure.findobj(Text) if isinstance(text, Text) and text.get_text()
        }
    assert sizes
    assert min(sizes) >= 7.0
    assert max(sizes) <= 8.0


def test_the_same_data_give_the_same_bytes_in_every_process() -> None:
    outputs = set()
    for seed in ("1", "2"):
        command = [sys.executable, "-c", PROGRAM]
        done = subprocess.run(
            command, env={"PYTHONHASHSEED": seed, "PATH": ""}, capture_output=True, text=True, check=True
        )
        outputs.add(done.stdout)
    (output,) = outputs
    assert len(set(output.split())) == len(FORMATS)
    assert b"Date" not in draw_figure(FIGURE, "pdf", 85)[0]


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(UnknownName, match=r"no format of figures called 'pfd'\. Did you mean 'pdf'"):
        draw_figure(FIGURE, "pfd", 85)
    with pytest.raises(BadInput, match="Choose 85 or 170 mm"):
        draw_figure(FIGURE, "pdf", 100)
    high = PrintFigure("high", "", _draw, 300.0)
    with pytest.raises(BadInput, match=r"The figure would be 30\d mm high"):
        draw_figure(high, "pdf", 85)


def test_lines_in_print_differ_without_colour() -> None:
    styles = [print_line_style(n) for n in range(28)]
    assert len({(str(style["linestyle"]), style["marker"]) for style in styles}) == 28
    for first, second in itertools.pairwise(styles):
        assert first["linestyle"] != second["linestyle"]
        assert first["marker"] != second["marker"]
    colours = [style["color"] for style in styles]
    assert len(set(colours)) == len(COLOURS) + 1
    assert set(colours[len(COLOURS) :]) == {MUTED}, "a colour is used twice"
    muted = [muted_line_style(n) for n in range(4 * (1 + len(MARKERS)))]
    assert len({(str(style["linestyle"]), style["marker"]) for style in muted}) == len(muted)
    assert len({style["color"] for style in muted}) == 1
