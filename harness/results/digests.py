"""SHA-256 digests of result files, which show that a file was damaged or edited after it was written.

The second line of a JSON file holds the digest of all its other lines: `sed 2d FILE | sha256sum` prints the same. The
digest of any other file stands in a JSON file. Whoever changes a file and computes all digests again is not noticed.
"""

import hashlib
import re
from pathlib import Path
from typing import Any

from harness.core import files
from harness.core.input_file import MEGABYTE, check_input_file, read_input_file
from harness.errors import BadFile

MAX_DIGESTED_BYTES = 1024 * MEGABYTE
"""Largest file whose digest is computed [choice]."""
_KEY = "sha256"
_LINE = re.compile(rb'{\n "sha256": "([0-9a-f]{64})",\n')


def insert_digest(text: str) -> str:
    """Insert the digest of a JSON text, as `core.files.to_json` gives it, as its second line."""
    if not text.startswith("{\n"):
        raise ValueError("a JSON object over several lines is needed")
    return f'{{\n "{_KEY}": "{hashlib.sha256(text.encode()).hexdigest()}",\n{text[2:]}'


def write_result_json(path: Path, content: Any) -> None:
    """Write a JSON object with its digest atomically."""
    files.write_text(path, insert_digest(files.to_json(content)))


def read_result_json(path: Path, expected: str, advice: str, limit_bytes: int = files.MAX_JSON_BYTES) -> dict[str, Any]:
    """Read a JSON object and check its digest, which is left out; `expected` and `advice` complete a refusal.

    BadFile when the file cannot be read, is no JSON object, has no digest or does not fit it.
    """
    data = read_input_file(path, expected, limit_bytes, advice)
    content = files.parse_json(path, data, expected, advice)
    line = _LINE.match(data)
    if line is None or content.pop(_KEY, None) != line[1].decode():
        raise BadFile(path, "no digest in its second line", f"{expected}, of this version of the harness", advice)
    state = hashlib.sha256(data[:2])
    state.update(data[line.end() :])
    if state.hexdigest() != line[1].decode():
        raise BadFile(path, "damaged or edited: its content does not fit its digest", expected, advice)
    return content


def file_digest(path: Path, expected: str, advice: str) -> str:
    """SHA-256 of a file, 64 hex digits; BadFile when it cannot be read."""
    check_input_file(path, expected, MAX_DIGESTED_BYTES, advice)
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise BadFile(path, f"cannot be read ({error.strerror})", expected, advice) from error


def check_file(path: Path, digest: Any, expected: str, advice: str) -> None:
    """BadFile when a file is missing or does not have this digest."""
    if file_digest(path, expected, advice) != digest:
        raise BadFile(path, "damaged or edited: its content does not fit its digest", expected, advice)
