"""Pages of the documents: tables made from the code are current, and the site has at most so many words."""

import pytest

from tests.doc_tables import TABLES, replace_table
from tests.site_words import MOST_WORDS, count_words, published_pages
from tests.test_prose import ROOT


@pytest.mark.parametrize("name", TABLES)
def test_a_table_of_the_documents_is_that_of_the_code(name: str) -> None:
    page = (ROOT / TABLES[name][0]).read_text(encoding="utf-8")
    assert page == replace_table(page, name), f"`python -m tests.doc_tables` writes the table {name}"


def test_every_key_of_a_scenario_has_a_row() -> None:
    keys = [row[0] for row in TABLES["scenario keys"][2]()]
    assert {"`noise`", "`motion.split`", "`stations.NAME.along`", "`tracker.baud`", "`disturbance.kind`"} <= set(keys)
    assert len(keys) == len(set(keys))


def test_words_are_counted_as_a_browser_shows_them() -> None:
    page = "# A [link](a/b.md#c) ![picture of it](x.png)\n\n<!-- a comment -->\n```toml\na = 1\n```\n"
    page += "| b | `c d` |\n|---|--:|\n"
    assert count_words(page) == 2 + 3 + 3


def test_the_site_is_no_longer_than_its_limit() -> None:
    counts = {page.relative_to(ROOT): count_words(page.read_text(encoding="utf-8")) for page in published_pages()}
    assert len(counts) > 10
    assert not any("notes" in page.parts for page in counts)
    assert sum(counts.values()) <= MOST_WORDS, f"python -m tests.site_words prints the words of each page: {counts}"
