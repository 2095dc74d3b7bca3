"""The browser's rendering of a page, and its file."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from harness.core.files import write_text
from harness.core.input_file import MEGABYTE, open_input_file
from harness.core.number_format import NOT_MEASURED, Interval
from harness.errors import BadFile
from harness.report.kit.document import PAGE_BEGIN, chart_figure, chart_panel, html_document
from harness.report.kit.markup import Markup, bullet_list, details, inline_code, join, scroll_box, tag, verdict_badge
from harness.report.kit.page import (
    Badge,
    Block,
    BrowserOnly,
    Bullets,
    Code,
    DataTable,
    Drawing,
    Page,
    Panels,
    Prose,
    Section,
    Stack,
    Strong,
    Tally,
    TerminalOnly,
)
from harness.report.kit.page_text import NUMBER
from harness.report.kit.style import Chart
from harness.report.kit.text import to_file_name

_LETTER_EM, _WIDE_EM, _WIDEST_EM, _LONG_CELL_LETTERS = 0.55, 22.0, 44.0, 300
"""Width of an average letter; greatest widths of columns of words, and of those with a cell of more letters than the
last number."""
_SPREAD = re.compile(r"((?<=\S) ± [\d.,]+)?( n\u00a0[\d, of]+)?$")
"""End of a text that is set in small type: a standard deviation, and the number of clips behind a mean."""
_NOT_MEASURED = tag("span", NOT_MEASURED, class_="none")


def check_page_place(path: Path) -> None:
    """BadFile where a file has this name that is no page of the harness: a page may be replaced, and nothing else."""
    if not path.exists():
        return
    with open_input_file(path, "a page to write", 64 * MEGABYTE, "Choose another.") as file:
        begin = file.read(len(PAGE_BEGIN))
    if begin != PAGE_BEGIN:
        raise BadFile(path, "it exists, and is no page of the harness", "a new file", "Choose another name.")


def write_page(page: Page, path: Path, plots: Path | None = None) -> Path:
    """Write the page to `path` and return it; its folder is created. Charts are also written to the folder `plots`."""
    text = render_html(page, plots)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, text)
    return path


def render_html(page: Page, plots: Path | None = None, *, with_charts: bool = True) -> str:
    """The HTML of a page; without charts their numbers are open."""
    return _Renderer(plots, with_charts).page(page)


class _Renderer:
    """Renders blocks, and writes each chart when it is drawn."""

    def __init__(self, plots: Path | None, with_charts: bool) -> None:
        self._plots, self._with_charts = plots, with_charts

    def page(self, page: Page) -> str:
        made_by = Section("Made by", "command", [Code(page.command)] if page.command else [])
        heading: Any = page.headline
        if page.verdict:
            word, outcome = page.verdict
            heading = join(tag("span", word, class_=f"big {to_file_name(outcome.word)}"), page.headline)
        picture, sections = self._lift_picture(page)
        return html_document(
            title=f"{page.name}: harness {page.verb}" if page.name else f"harness {page.verb}",
            kicker=f"harness {page.verb}" + (f" · {page.name}" if page.name else ""),
            heading=heading,
            facts={title: text for title, text in page.facts.items() if text},
            missing=page.missing,
            sections=[(s.title, s.name, self.blocks(s.blocks, s.title)) for s in (*sections, made_by)],
            lead=self.blocks([block for block in page.lead if not isinstance(block, DataTable)], page.name) or None,
            picture=picture,
            tables=self.blocks([block for block in page.lead if isinstance(block, DataTable)], page.name) or None,
        )

    def _lift_picture(self, page: Page) -> tuple[Markup | None, Sequence[Section]]:
        """The first chart of the sections, for the first screen, and the sections without it.

        None for a page whose lead has a picture of its own, and without charts.
        """
        if self._with_charts and not any(isinstance(block, Drawing | BrowserOnly) for block in page.lead):
            for at, section in enumerate(page.sections):
                picture, blocks = self._lift(section.blocks)
                if picture:
                    lifted = replace(section, blocks=blocks)
                    return picture, [*page.sections[:at], lifted, *page.sections[at + 1 :]]
        return None, page.sections

    def _lift(self, blocks: Sequence[Any]) -> tuple[Markup | None, Sequence[Any]]:
        """The first chart of blocks that are not folded, and the blocks without it."""
        for n, block in enumerate(blocks):
            if isinstance(block, Panels) and block.charts and (panel := block.charts[0][1]()):
                rest = replace(block, charts=block.charts[1:])
                return chart_panel(panel, block.charts[0][0]), [*blocks[:n], rest, *blocks[n + 1 :]]
            if isinstance(block, Drawing) and (chart := self._chart(block)):
                return chart_figure(chart), [*blocks[:n], BrowserOnly(block.tables, block.fold), *blocks[n + 1 :]]
            if isinstance(block, BrowserOnly) and not block.fold:
                picture, inner = self._lift(block.blocks)
                if picture:
                    return picture, [*blocks[:n], replace(block, blocks=inner), *blocks[n + 1 :]]
        return None, blocks

    def _chart(self, block: Drawing) -> Chart | None:
        """The chart of a drawing, which is also written to the folder of plots."""
        chart = (block.chart if isinstance(block.chart, Chart) else block.chart()) if self._with_charts else None
        if chart and self._plots is not None:
            chart.write(self._plots)
        return chart

    def blocks(self, blocks: Sequence[Block | Markup], label: str) -> Markup:
        several = sum(isinstance(block, Drawing) for block in blocks) > 1
        return join(*(self._block(block, label, 3 if several else 0) for block in blocks))

    def _block(self, block: Block | Markup, label: str, level: int) -> Markup:
        match block:
            case Markup():
                return block
            case Prose():
                return tag("p", _words(block.text), class_="missing" if block.is_warning else None)
            case Bullets():
                title = tag("h3", block.title) if block.title and block.items else None
                return join(title, bullet_list([_words(item) for item in block.items]))
            case Code():
                listing = tag("pre", block.text if block.title else tag("code", block.text))
                return details(block.title, listing) if block.title else listing
            case Tally():
                return _tally(block)
            case DataTable():
                table = page_table(block, label)
                return details(block.fold, table) if block.fold and table else table
            case Drawing():
                return self._drawing(block, label, level)
            case Panels():
                drawn = [(heading, draw()) for heading, draw in block.charts] if self._with_charts else []
                panels = [chart_panel(chart, heading) for heading, chart in drawn if chart]
                return tag("div", *panels, class_=f"panels{' broad' * block.broad}") if panels else Markup()
            case BrowserOnly():
                content = self.blocks(block.blocks, block.fold or label)
                return details(block.fold, content) if block.fold and content else content
            case TerminalOnly():
                return Markup()

    def _drawing(self, block: Drawing, label: str, level: int) -> Markup:
        numbers = join(*(page_table(table, label) for table in block.tables))
        chart = self._chart(block)
        if chart is None:
            return numbers
        figure = chart_figure(chart, level if block.level is None else block.level)
        return join(figure, details(block.fold, numbers) if numbers else None)


def page_table(table: DataTable, label: str = "") -> Markup:
    """A table as HTML: numbers are aligned right, columns of words left; nothing without rows."""
    if not table.rows:
        return Markup()
    used = [n for n in range(len(table.head)) if n == 0 or any(str(row[n]) for row in table.rows if len(row) > 1)]
    rows = [[row[n] for n in used] if len(row) > 1 else row for row in table.rows]
    table = replace(table, head=[table.head[n] for n in used], rows=rows)
    label = table.label or table.title or label.lower()
    title = tag("b", table.title) if table.title else None
    more = f"{table.omitted:,} more are left out." if table.omitted else ""
    texts = [title, _words(table.caption) if table.caption else None, more or None]
    caption = join(*(part for n, text in enumerate(filter(None, texts)) for part in (" " if n else "", text)))
    if table.cards:
        return join(tag("p", caption, class_="caption"), _cards(table, label))
    columns = zip(table.head, *table.rows, strict=True)
    cells = [[_cell(cell) for cell in next(columns)], *map(_column, columns)]
    head, *body = map(list, zip(*cells, strict=True))
    rows_of_head = tag("tr", *(tag("th", cell, scope="col") for cell in head))
    lines = [tag("tr", tag("th", first, scope="row"), *(tag("td", cell) for cell in rest)) for first, *rest in body]
    content = tag("table", tag("thead", rows_of_head), tag("tbody", *lines), aria_label=label)
    return join(tag("p", caption, class_="caption"), scroll_box(content, label))


def _tally(tally: Tally) -> Markup:
    """For each verdict its count, its badge and its meaning."""
    items = [
        tag("li", tag("b", count), badge, tag("span", tally.meanings[verdict], class_="meaning"))
        for verdict, count in tally.counts.items()
        for badge in [verdict_badge(verdict, tally.marks[verdict])]
    ]
    return tag("ul", *items, class_="tally")


def _cards(table: DataTable, label: str) -> Markup:
    """A table as wide as the page, whose rows are cards on a phone; roles say there what the look no longer does."""
    head = tag("tr", *(tag("th", text, scope="col", role="columnheader") for text in table.head), role="row")
    rows = [_card(table, row) if len(row) > 1 else _group(table, row[0]) for row in table.rows]
    body = tag("thead", head, role="rowgroup"), tag("tbody", *rows, role="rowgroup")
    return tag("table", *body, class_="claims", role="table", aria_label=label)


def _card(table: DataTable, row: Sequence[object]) -> Markup:
    cells = [
        tag("td", _cell(cell), data_label=name, role="cell", class_=None if str(cell) else "empty")
        for name, cell in zip(table.head[1:], row[1:], strict=True)
    ]
    return tag("tr", tag("th", _cell(row[0]), scope="row", role="rowheader"), *cells, role="row")


def _group(table: DataTable, title: object) -> Markup:
    content = tag("th", _cell(title), scope="rowgroup", colspan=len(table.head), role="rowheader")
    return tag("tr", content, class_="group", role="row")


def _words(text: str) -> Markup:
    if isinstance(text, Markup):
        return text
    end = _SPREAD.search(text)
    words, spread = (text[: end.start()], end[0]) if end else (text, "")
    return join(inline_code(words), tag("span", spread, class_="spread") if spread else None)


def _column(cells: Sequence[Any]) -> list[Any]:
    """The cells of one column, its head first."""
    head, rest = _words(cells[0]), cells[1:]
    texts = [str(cell.upper) if isinstance(cell, Stack) else cell for cell in rest]
    if all(NUMBER.fullmatch(text) for text in texts if isinstance(text, str)):
        return [head, *map(_cell, rest)]
    longest = max(map(len, map(str, cells)))
    most = _WIDEST_EM if longest > _LONG_CELL_LETTERS else _WIDE_EM
    width = f"width: {min(_LETTER_EM * longest + 1.0, most):.0f}em"
    return [
        tag("span", _cell(cell), class_="words", style=width) if isinstance(cell, str | Stack) else _cell(cell)
        for cell in cells
    ]


def _cell(cell: Any) -> Any:
    match cell:
        case Interval():
            return _stacked(cell.number, cell.ends) if cell.is_measured else _NOT_MEASURED
        case Badge():
            return _stacked(verdict_badge(cell.verdict, cell.mark), cell.why, "why")
        case Strong():
            return tag("strong", _cell(cell.cell))
        case Stack():
            return _stacked(_cell(cell.upper), _words(cell.lower))
        case str():
            return _NOT_MEASURED if cell == NOT_MEASURED else _words(cell)
        case _:
            return cell


def _stacked(upper: Any, lower: Any, class_: str = "spread under") -> Markup:
    """A cell of two lines, the lower one in small type; an empty lower line is left out."""
    return join(upper, tag("span", lower, class_=class_) if lower else None)
