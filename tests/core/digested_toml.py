"""TOML files with a digest, changed as a person or an earlier version would have it."""

import re
from pathlib import Path


def declare_edited(text: str) -> str:
    """The text of a file that says in its first line that it was edited."""
    return re.sub(r'^sha256 = "[0-9a-f]{64}"', 'sha256 = "edited"', text, count=1)


def as_earlier_version(path: Path) -> str:
    """The text of a file as versions without digests wrote it."""
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    return "".join(lines[1:]).replace("schema = 2", "schema = 1")
