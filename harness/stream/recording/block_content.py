"""What the JSON in blocks of a recording says."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from harness.core.fields import build
from harness.core.parsing import parse_json
from harness.errors import BadFile, HarnessError
from harness.stream.polhemus.codec.reader import WireFormat
from harness.stream.recording.blocks import NOTE, RecordingBlock

EXPECTED_FILE = "a recording by `harness record`"
PLAN_FILE = "plan"
"""Name of the plan's digest in a note."""


def block_content(path: Path, block: RecordingBlock) -> dict[str, Any]:
    """Parse a block of JSON; an empty mapping for JSON of another kind. Raises BadFile that names the file."""
    try:
        content = parse_json(block.payload.decode("utf-8"))
    except ValueError as error:
        raise BadFile(path, f"a {block.kind} block that is not JSON", EXPECTED_FILE, "") from error
    return content if isinstance(content, dict) else {}


def wire_format_of(path: Path, configured: RecordingBlock) -> WireFormat:
    """Parse the wire format in a "conf" block. Raises BadFile."""
    content = block_content(path, configured)
    try:
        content["characters"] = str(content.get("characters", "")).encode()
        return build(WireFormat, content, "wire format")
    except (TypeError, HarnessError) as error:
        raise BadFile(path, f"an unusable wire format ({error})", EXPECTED_FILE, "") from error


def timed_contents(path: Path, blocks: Iterable[RecordingBlock], kind: str) -> list[dict[str, Any]]:
    """The JSON of the blocks of a kind, with their time on the host's clock [s]. Raises BadFile."""
    return [{"monotonic_s": block.monotonic_s, **block_content(path, block)} for block in blocks if block.kind == kind]


def note_values(path: Path, blocks: Iterable[RecordingBlock], name: str) -> tuple[str, ...]:
    """The different values that notes have under a name, in the order of the blocks. Raises BadFile.

    "" stands for a note without the name, and for blocks that come before the first note.
    """
    values: dict[str, None] = {}
    for block in blocks:
        if block.kind == NOTE:
            values[str(block_content(path, block).get(name) or "")] = None
        elif not values:
            values[""] = None
    return tuple(values)
