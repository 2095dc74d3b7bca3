"""Replaces the part of a Markdown page that stands between two markers, which name what wrote it."""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path

from harness.core.file_kind import wrong_file
from harness.core.files import write_text
from harness.core.input_file import MEGABYTE, read_input_file
from harness.errors import BadFile

_EXPECTED, _NEWLINE = "a text file with both markers or none", "\n"


def read_page(page: Path) -> str:
    """The text of a page that `replace_block` may change; BadFile if it is no text that can be read."""
    advice = "Name README.md or results/README.md."
    data = read_input_file(page, _EXPECTED, 16 * MEGABYTE, advice)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise wrong_file(page, f"byte {error.start + 1} is not UTF-8", _EXPECTED, advice) from error


def replace_block(page: Path, label: str, lines: Iterable[str]) -> None:
    """Put `lines` between the markers of `label` in `page`, or append them with their markers; no other byte changes.

    No line can end the block. BadFile as `read_page`, and if the two markers are not there exactly once and in order.
    """
    text = read_page(page)
    name = re.sub(r"[^\w. ]+", "-", label).strip("-")
    start, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
    block = "\n".join([start, *map(_escape_markers, lines), end])
    if text.count(start) != text.count(end) or text.count(start) > 1 or text.find(start) > text.find(end):
        why = f"the markers {start} and {end} do not occur once each in this order"
        raise BadFile(page, why, _EXPECTED, "Restore both markers, or remove both to append the tables at the end.")
    if start in text:
        before, _, rest = text.partition(start)
        updated = before + block + rest.partition(end)[2]
    else:
        updated = f"{text}{'' if text.endswith(_NEWLINE) else _NEWLINE}\n{block}\n"
    if updated != text:
        write_text(page, updated)


def describe_code(circumstances: Mapping[str, object]) -> str:
    """The version of the harness that made something, such as "harness 0.1.0, commit 0fb4ebc7c52a"."""
    commit = f"commit {str(circumstances['commit'])[:12]}" if circumstances.get("commit") else "no commit"
    changes = " with uncommitted changes" if circumstances.get("dirty") else ""
    return f"harness {circumstances.get('harness')}, {commit}{changes}"


def _escape_markers(line: str) -> str:
    """The line without line breaks, and with no text that could be taken for a marker."""
    return re.sub(r"[\r\n]+", " ", line).replace("<!--", "<! --")
