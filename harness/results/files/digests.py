"""SHA-256 digests of result files, which show that a file was damaged or edited after it was written.

The second line of a JSON file holds the digest of all its other lines: `sed 2d FILE | sha256sum` prints the same. The
digest of any other file stands in a JSON file. Whoever changes a file and computes all digests again is not noticed.
"""

import hashlib
import re
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from harness.core import files
from harness.core.fields import build
from harness.core.input_file import MEGABYTE, check_input_file, read_input_file
from harness.errors import BadFile, HarnessError, shorten

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

T = TypeVar("T", bound="DataclassInstance")

MAX_DIGESTED_BYTES = 1024 * MEGABYTE
"""Largest file whose digest is computed [choice]."""
STUDY_FILE = "study.json"
"""File that says of which study a folder is (see `storage.open_folder`)."""
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


def write_record(path: Path, record: "DataclassInstance") -> None:
    """Write a record as JSON with its digest atomically; `read_record` reads it again."""
    write_result_json(path, asdict(record))


def read_record(
    kind: type[T],
    path: Path,
    expected: str,
    advice: str,
    renamed: Callable[[dict[str, Any]], dict[str, Any]] = lambda content: content,
) -> T:
    """Read a record by its annotations (`core.fields.build`).

    BadFile as from `read_result_json`, for another `schema` than that of the record, if it has one, and for keys and
    values that do not fit. `renamed` gives the keys of earlier versions their names of today.
    """
    content = read_result_json(path, expected, advice)
    found = content.get("schema")
    if found != (schema := getattr(kind, "schema", None)):
        raise BadFile(path, f"schema {found}", f"schema {schema}", advice)
    try:
        return build(kind, renamed(content), path.stem)
    except (TypeError, ValueError, HarnessError) as error:
        raise BadFile(path, str(error), expected, advice) from error


def check_key(path: Path, found: Any, key: Any, expected: str, advice: str) -> None:
    """BadFile when the key in a file is not the one by which it is read: the file belongs into another place."""
    if found != key:
        what = "no word of what it is of" if found is None else f"of {shorten(str(found), 80)}"
        raise BadFile(path, what, f"{expected}, of {shorten(str(key), 80)}", advice)


def check_study(path: Path, identity: Mapping[str, Any], expected: str, advice: str) -> None:
    """BadFile when the findings at `path` are of another study than study.json beside them.

    Nothing is checked without study.json: such a folder is of no study.
    """
    study = path.with_name(STUDY_FILE)
    if study.is_file():
        stored = read_result_json(study, "the identity of a study", advice)
        for name, value in identity.items():
            check_key(path, value, stored.get(name), f"{expected}, as {STUDY_FILE} says", advice)


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
