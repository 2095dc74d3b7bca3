"""Text of TOML files, and files whose first line is a SHA-256 digest of all other lines.

The digest shows a lost line, a cut and an edit. Since schema 2 it is required, so that a file which lost its first line
is noticed too. Who edits a file says so there: sha256 = "edited". Files of schema 1 have no digest; their readers look
for what such a file always has.
"""

import hashlib
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w

from harness.core.file_kind import check_toml_kind
from harness.core.files import MAX_TOML_BYTES, parse_toml
from harness.core.input_file import read_input_file
from harness.errors import BadFile

_ARRAY = re.compile(r"\[\n +([^\[\]]*),\n *\]")
"""An array without arrays in it, as tomli-w writes it: one line for each value. Strings have no line breaks."""


def format_toml(content: Mapping[str, Any]) -> str:
    """The text of tables, with arrays on one line; TypeError for values that TOML does not have."""
    return _ARRAY.sub(lambda found: "[" + re.sub(r",\n +", ", ", found[1]) + "]", tomli_w.dumps(content))


SCHEMA = 2
EARLIER_SCHEMA = 1
"""Schema of files without a digest."""
_KEY, _EDITED = "sha256", "edited"
_LINE = re.compile(rb'sha256 = "([0-9a-f]{64})"[^\n]*\n')


def insert_toml_digest(text: str) -> str:
    """The text with the digest of it in front."""
    hint = f'of all other lines; after an edit by hand write: {_KEY} = "{_EDITED}"'
    return f'{_KEY} = "{_digest(text.encode())}" # {hint}\n{text}'


def read_digested_toml(path: Path, expected: str, advice: str) -> tuple[dict[str, Any], str]:
    """The content of a file without its digest, and what cannot be verified of it, "" if the digest fits.

    BadFile for a file that is no TOML, of another schema, without a digest though its schema has one, and for one that
    does not fit it. `expected` and `advice` complete the message.
    """
    data = read_input_file(path, expected, MAX_TOML_BYTES, advice).replace(b"\r\n", b"\n")
    content = parse_toml(path, data, expected, advice)
    check_toml_kind(path, content, expected, advice)
    stored, schema = content.pop(_KEY, None), content.get("schema")
    if schema == EARLIER_SCHEMA and not isinstance(schema, bool) and stored is None:
        return content, "an earlier version wrote it without a digest: not every lost line in it is noticed"
    if schema != SCHEMA:
        found = "no schema" if schema is None else f"schema {schema!r}"
        repair = advice if schema is None else "This version of the harness reads no other."
        raise BadFile(path, found, f"{expected} of schema {SCHEMA}", repair)
    if stored == _EDITED:
        return content, "it was edited by hand: lost lines in it are not noticed"
    line = _LINE.match(data)
    if line is None or _digest(data[line.end() :]) != line[1].decode():
        found = "no digest in its first line" if stored is None else "its content does not fit its digest"
        repair = f'Restore it from a copy. If you edited it on purpose, its first line is {_KEY} = "{_EDITED}".'
        raise BadFile(path, f"damaged or edited: {found}", f"{expected} as it was written", repair)
    return content, ""


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
