"""The kit of pages: the record of a page, its renderers, charts, and the motion player."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.report.kit.chart import draw_chart as draw_chart
    from harness.report.kit.document import html_document as html_document
    from harness.report.kit.document import page_style as page_style
    from harness.report.kit.marked_block import read_page as read_page
    from harness.report.kit.markup import Markup as Markup
    from harness.report.kit.markup import join as join
    from harness.report.kit.markup import tag as tag
    from harness.report.kit.motion_player import NO_ESTIMATE as NO_ESTIMATE
    from harness.report.kit.motion_player import PlayerClip as PlayerClip
    from harness.report.kit.motion_player import PlayerMotion as PlayerMotion
    from harness.report.kit.motion_player import PlayerStations as PlayerStations
    from harness.report.kit.motion_player import PlayerTrack as PlayerTrack
    from harness.report.kit.motion_player import bone_radii_mm as bone_radii_mm
    from harness.report.kit.motion_player import describe_body as describe_body
    from harness.report.kit.motion_player import hold_last as hold_last
    from harness.report.kit.motion_player import pack_clip as pack_clip
    from harness.report.kit.motion_player import player_card as player_card
    from harness.report.kit.motion_player import player_element as player_element
    from harness.report.kit.motion_player import player_script as player_script
    from harness.report.kit.page import Page as Page
    from harness.report.kit.page_html import check_page_place as check_page_place
    from harness.report.kit.page_html import render_html as render_html
    from harness.report.kit.page_html import write_page as write_page
    from harness.report.kit.page_text import render_text as render_text
    from harness.report.kit.render_process import RenderJob as RenderJob
    from harness.report.kit.render_process import RenderProcess as RenderProcess
    from harness.report.kit.render_process import finish_renderer as finish_renderer
    from harness.report.kit.render_process import start_renderer as start_renderer
    from harness.report.kit.statement_lines import MARKS as MARKS
    from harness.report.kit.statement_lines import format_statements as format_statements
    from harness.report.kit.text import last_line as last_line
    from harness.report.kit.text import to_file_name as to_file_name
else:
    __getattr__, __dir__ = lazy_names(__name__)
