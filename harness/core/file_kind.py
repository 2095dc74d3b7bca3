"""What a file is, told by its content: a message about a wrong file names what it is and which verb reads it."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from harness.core import parsing
from harness.core.input_file import MEGABYTE
from harness.errors import BadFile

POSES_KIND = "a recording of poses"
_READERS = {
    "a scenario": "`harness run` runs it.",
    "a sweep": "`harness sweep` runs it.",
    "a placement study": "`harness placement` runs it.",
    "a trust plan": "`harness trust` and `harness record --plan` read it.",
    "a calibration": "`harness live --calibration` and `harness replay --calibration` read it.",
    "a unit file": "`harness characterize --expect` and scenarios read it.",
    "a recording": "`harness replay` and `harness view` read it.",
    POSES_KIND: "`harness inspect`, `replay` and `view` read it.",
    "a BVH motion": "`harness inspect` and `harness view` read it.",
    "a list of emitters": "`harness inspect` reads it as NAME.mcf.",
    "a file of results": "Name the folder that holds it.",
    "an SQLite database": "",
    "an empty file": "",
    "binary data": "",
}
"""What a file can be -> what reads it."""
_KINDS = {
    "placement": "a placement study",
    "trust plan": "a trust plan",
    "unit": "a unit file",
    "poses": "a calibration",
    "tpose": "a calibration",
}
"""Value of the key `kind` -> what the TOML file is."""
_KEYS = {"scenarios": "a sweep", "motion": "a scenario"}
_PATTERNS = (
    (rb"\A\x89IS900\r\n\x02\x00", POSES_KIND),
    (rb"\A\x89IS900\r\n", "a recording"),
    (rb"\A\s*HIERARCHY\s", "a BVH motion"),
    (rb"(?s)\ASQLite format 3\x00.*CREATE TABLE cells", "a file of results"),
    (rb"\ASQLite format 3\x00", "an SQLite database"),
    (rb"(?m)^31F +\d", "a list of emitters"),
    (rb"\x00", "binary data"),
)
"""Pattern of the content -> what the file is; the first one that occurs counts."""
_RESULTS = ("findings.json", "summary.json", "manifest.json", "cells.json", "cell.json", "study.json")


def toml_kind(content: Mapping[str, Any]) -> str:
    """What a TOML file of this content is, such as "a trust plan"; "" for no kind that the harness reads."""
    kind = content.get("kind")
    named = _KINDS.get(kind, "") if isinstance(kind, str) else ""
    return named or next((name for key, name in _KEYS.items() if key in content), "")


def file_kind(path: Path) -> str:
    """What a file is, such as "a recording"; "" where its first megabyte does not tell, and for what is no file."""
    if not path.is_file():  # a FIFO would wait for ever
        return ""
    if path.name == "summary.csv":
        return "a file of results"
    try:
        with open(path, "rb") as file:
            data = file.read(MEGABYTE)
        if not data:
            return "an empty file"
        if path.name in _RESULTS:  # a damaged one is none
            parsing.parse_json(data.decode("utf-8"))
            return "a file of results"
        named = next((name for pattern, name in _PATTERNS if re.search(pattern, data)), "")
        return named or toml_kind(parsing.parse_toml(data.decode("utf-8").replace("\r\n", "\n")))
    except (OSError, ValueError):
        return ""


def wrong_file(path: Path, found: str, expected: str, advice: str) -> BadFile:
    """The error about a file of another kind than the expected one.

    It says what the file is and what reads it, where the content tells; else, as for a damaged file of the expected
    kind, `found` and `advice`.
    """
    kind = file_kind(path)
    kind = "" if kind in expected else kind
    return BadFile(path, kind or found, expected, _READERS.get(kind) or advice)


def check_toml_kind(
    path: Path, content: Mapping[str, Any], expected: str, advice: str, *, needs_kind: str = ""
) -> None:
    """BadFile unless a TOML file is what is expected, such as "a trust plan", or of no known kind.

    With `needs_kind` the key `kind` has to have this value.
    """
    kind = toml_kind(content)
    if kind not in ("", expected):
        raise BadFile(path, kind, expected, _READERS[kind])
    if needs_kind and kind != expected:
        found = f"kind = {content['kind']!r}" if "kind" in content else "no key `kind`"
        raise BadFile(path, found, f'{expected}, kind = "{needs_kind}"', advice)
