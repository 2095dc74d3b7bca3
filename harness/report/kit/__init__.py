"""The kit of pages: the record of a page, its renderers, charts, and the motion player."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.report.kit.chart import draw_chart
    from harness.report.kit.document import html_document, page_style
    from harness.report.kit.marked_block import read_page
    from harness.report.kit.markup import Markup, join, tag
    from harness.report.kit.motion_player import (
        NO_ESTIMATE,
        PlayerClip,
        PlayerMotion,
        PlayerStations,
        PlayerTrack,
        bone_radii_mm,
        describe_body,
        hold_last,
        pack_clip,
        player_card,
        player_element,
        player_script,
    )
    from harness.report.kit.page import Page
    from harness.report.kit.page_html import check_page_place, render_html, write_page
    from harness.report.kit.page_text import render_text
    from harness.report.kit.render_process import RenderJob, RenderProcess, finish_renderer, start_renderer
    from harness.report.kit.statement_lines import MARKS, format_statements
    from harness.report.kit.text import last_line, to_file_name
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "MARKS",
    "NO_ESTIMATE",
    "Markup",
    "Page",
    "PlayerClip",
    "PlayerMotion",
    "PlayerStations",
    "PlayerTrack",
    "RenderJob",
    "RenderProcess",
    "bone_radii_mm",
    "check_page_place",
    "describe_body",
    "draw_chart",
    "finish_renderer",
    "format_statements",
    "hold_last",
    "html_document",
    "join",
    "last_line",
    "pack_clip",
    "page_style",
    "player_card",
    "player_element",
    "player_script",
    "read_page",
    "render_html",
    "render_text",
    "start_renderer",
    "tag",
    "to_file_name",
    "write_page",
]
