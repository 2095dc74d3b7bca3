"""One record of a page, two renderings: both say the same, and neither breaks on what it is given."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from harness.core.number_format import Interval
from harness.errors import Outcome
from harness.report.kit.markup import Markup
from harness.report.kit.page import (
    Badge,
    Block,
    BrowserOnly,
    Bullets,
    Code,
    DataTable,
    Drawing,
    Page,
    Prose,
    Section,
    Stack,
    Tally,
    TerminalOnly,
)
from harness.report.kit.page_html import write_page
from harness.report.kit.page_text import render_text
from harness.report.kit.style import Chart
from tests.report.reading import read, text_of

HOSTILE = "<script>alert(1)</script>&\"'"
LENGTH = Interval(1.2, 1.19, 1.21, unit="mm")


def page_of(*blocks: Block, lead: Sequence[Block] = ()) -> Page:
    facts = {"Motion": "3 clips", "Nothing": ""}
    verdict = ("Contradicted", Outcome.REGRESSED)
    return Page(
        "trust", "a study", "It differs.", facts, [Section("Part", "part", blocks)], verdict, lead, command="harness x"
    )


def chart() -> Chart:
    svg = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 1 1"><defs></defs></svg>'
    return Chart("pairs", "Pairs", "A caption.", "Alternative text.", svg)


def test_both_renderings_have_every_part_that_is_for_both(tmp_path: Path) -> None:
    table = DataTable(
        ["pair", "verdict", "length", "n"],
        [
            ["a and b", Badge("agree", "✓", "both say so"), LENGTH, 8],
            ["c", Stack("x", "y"), Interval.missing("none"), 1],
        ],
        title="Pairs",
        caption="What they are.",
    )
    page = page_of(table, Bullets(["one", "two"]), Prose("A sentence."), lead=[Prose("First.", is_warning=True)])
    text, html = render_text(page), text_of(write_page(page, tmp_path / "page.html"))
    for part in ("It differs.", "First.", "3 clips", "Pairs", "agree", "both say so", "1.20 mm", "1.19 to 1.21", "one"):
        assert part in text
        assert part in html
    assert "1.20 mm (1.19 to 1.21)" in text
    assert "✓ agree: both say so" in text
    assert "x (y)" in text
    assert "not measured" in text
    assert "What they are." in html
    assert "What they are." not in text
    assert "Nothing" not in text + html
    assert html.index("Contradicted") < html.index("It differs.") < html.index("First.")


def test_what_only_a_browser_shows_is_not_printed(tmp_path: Path) -> None:
    numbers = DataTable(["a", "b"], [["x", "1"]])
    page = page_of(
        Drawing(chart, numbers),
        BrowserOnly([Prose("hidden")], "More"),
        Code("harness run", "Listing"),
        BrowserOnly([Markup("<b>player</b>")]),
        Tally({"met": 2}, {"met": "✓"}, {"met": "as wanted"}),
        BrowserOnly([Prose("How to read it.")]),
        TerminalOnly([Prose("In a terminal alone.")]),
    )
    file = write_page(page, tmp_path / "page.html", tmp_path)
    html, text = text_of(file), render_text(page)
    for part in ("Numbers of this chart", "hidden", "harness run", "player", "as wanted", "How to read it."):
        assert part in html
        assert part not in text
    assert "x  1" in text
    assert "In a terminal alone." in text
    assert "In a terminal alone." not in html
    assert (tmp_path / "pairs.svg").read_text() == chart().svg
    folded = [name for name, _ in read(file).found if name == "details"]
    assert len(folded) == 3


def test_without_a_chart_its_numbers_are_open(tmp_path: Path) -> None:
    page = page_of(Drawing(lambda: None, DataTable(["a", "b"], [["x", "1"]])))
    file = write_page(page, tmp_path / "page.html")
    assert "details" not in [name for name, _ in read(file).found]
    assert "x 1" in text_of(file)


def test_a_section_without_content_is_left_out(tmp_path: Path) -> None:
    page = page_of(DataTable(["a"], []), Bullets([], title="Nothing"), Drawing(lambda: None))
    assert "part" not in render_text(page)
    sections = [a["id"] for name, a in read(write_page(page, tmp_path / "page.html")).found if name == "section"]
    assert sections == ["command"]


def test_no_name_becomes_markup(tmp_path: Path) -> None:
    cells = [HOSTILE, Badge(HOSTILE, "✗", HOSTILE), Stack(HOSTILE, HOSTILE)]
    table = DataTable([HOSTILE] * 3, [cells], HOSTILE, HOSTILE, HOSTILE)
    page = page_of(
        table, Prose(HOSTILE), Bullets([HOSTILE]), Code(HOSTILE, HOSTILE), BrowserOnly([Prose(HOSTILE)], HOSTILE)
    )
    file = write_page(page, tmp_path / "page.html")
    assert "<script>alert" not in file.read_text(encoding="utf-8")
    assert text_of(file).count(HOSTILE) > 10


@pytest.mark.parametrize("width", [60, 118])
def test_lines_of_a_terminal_fit(width: int) -> None:
    table = DataTable(["name", "what it means", "n"], [["a name of some words " * 3, "words " * 30, LENGTH]])
    lines = render_text(page_of(table, Prose("words " * 50), Bullets(["words " * 50])), width).splitlines()
    assert max(map(len, lines)) <= width


def test_a_terminal_cuts_long_tables_and_leaves_out_empty_columns() -> None:
    table = DataTable(["a", "nothing", "b"], [[f"row {n}", "", LENGTH] for n in range(9)], most_printed=4)
    lines = render_text(page_of(table)).splitlines()
    assert lines[-1] == "and 5 more"
    assert "nothing" not in "\n".join(lines)
    narrow = DataTable(["a", "b"], [["row", LENGTH]], intervals_printed=False)
    assert render_text(page_of(narrow)).splitlines()[-1] == "row  1.20 mm"


def test_a_row_of_one_cell_is_a_heading_of_rows(tmp_path: Path) -> None:
    table = DataTable(["claim", "verdict"], [["first group"], ["a", Badge("met", "✓")], ["b", ""]], cards=True)
    file = write_page(page_of(table), tmp_path / "page.html")
    assert render_text(page_of(table)).splitlines()[-5:] == ["claim  verdict", "", "first group", "a      ✓ met", "b"]
    found = read(file).found
    assert [a.get("data-label") for name, a in found if name == "td"] == ["verdict"] * 2
    assert [a for name, a in found if a.get("colspan") == "2"] == [
        {"scope": "rowgroup", "colspan": "2", "role": "rowheader"}
    ]
