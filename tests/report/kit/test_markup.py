"""Text in HTML is escaped."""

import pytest

from harness.report.kit.markup import Markup, join, tag
from harness.report.kit.page import DataTable
from harness.report.kit.page_html import page_table


def test_children_and_attributes_are_escaped() -> None:
    assert tag("p", "<b>", tag("i", "&"), title='"x"') == '<p title="&quot;x&quot;">&lt;b&gt;<i>&amp;</i></p>'


@pytest.mark.parametrize(("written", "read"), [("class_", "class"), ("aria_label", "aria-label"), ("id", "id")])
def test_attribute_names(written: str, read: str) -> None:
    assert tag("p", **{written: "x"}) == f'<p {read}="x"></p>'


def test_absent_things_leave_no_trace() -> None:
    assert tag("img", alt="", hidden=False, src=None, async_=True) == '<img alt="" async>'
    assert join(None, "a", Markup("<br>"), 1.5) == "a<br>1.5"


def test_a_table_names_its_rows_and_columns() -> None:
    text = page_table(DataTable(["method", "n"], [["<ik>", 3]], caption="about <it>", label="errors"))
    assert '<th scope="col">method</th>' in text
    assert '<th scope="row">&lt;ik&gt;</th><td>3</td>' in text
    assert 'tabindex="0"' in text
    assert "about &lt;it&gt;" in text
