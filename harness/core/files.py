"""JSON that is the same for the same content, and files that are there whole or not at all."""

import hashlib
import json
import math
import os
from collections.abc import Iterable, Mapping
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.errors import BadFile

TEMPORARY = ".unfinished-"
"""What names of things begin with that are still being written; a killed run leaves them behind."""


def to_json_types(value: Any) -> Any:
    """The same value in JSON's own types; NaN and infinity become null."""
    match value:
        case Mapping():
            return {str(key): to_json_types(item) for key, item in value.items()}
        case np.ndarray() | np.generic():
            return to_json_types(value.tolist())
        case list() | tuple():
            return [to_json_types(item) for item in value]
        case Enum():
            return to_json_types(value.value)
        case Path():
            return value.as_posix()
        case float():
            return value if math.isfinite(value) else None
        case _:
            return value


def content_key(content: Any) -> str:
    """32 hex digits that stand for the content, whatever the order of its keys."""
    text = json.dumps(to_json_types(content), sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def digest(*arrays: NDArray[Any]) -> str:
    """16 hex digits that stand for the values and shapes of arrays."""
    state = hashlib.blake2b(digest_size=8)
    for array in arrays:
        state.update(str(array.shape).encode())
        state.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
    return state.hexdigest()


def write_text(path: Path, text: str) -> None:
    """Write beside, flush to the disk, rename: readers see the old file or the new one."""
    write_parts(path, [text])


def write_parts(path: Path, texts: Iterable[str]) -> None:
    """The same with a text that comes in parts."""
    beside = path.with_name(f"{TEMPORARY}{os.getpid()}-{path.name}")
    with open(beside, "w", encoding="utf-8", newline="") as file:
        file.writelines(texts)
        file.flush()
        os.fsync(file.fileno())
    os.replace(beside, path)


def write_json(path: Path, content: Any) -> None:
    write_text(path, to_json(content))


def to_json(content: Any) -> str:
    return json.dumps(to_json_types(content), indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def read_json(path: Path, expected: str) -> dict[str, Any]:
    """A JSON object; BadFile says what was expected of a file that is none."""
    advice = "Is this a folder written by `harness run`?"
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise BadFile(path, f"cannot be read ({error.strerror})", expected, advice) from error
    except ValueError as error:
        raise BadFile(path, f"not JSON: {error}", expected, advice) from error
    if not isinstance(content, dict):
        raise BadFile(path, f"a JSON {type(content).__name__}", expected, advice)
    return content
