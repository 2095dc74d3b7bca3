"""Changes files of results and computes their digests again, for tests of the checks that lie behind the digests."""

import json
from pathlib import Path
from typing import Any

from harness.results.files.digests import insert_digest
from harness.results.files.integrity import compute_digests
from harness.results.index import CellIndex


def read_json(path: Path) -> dict[str, Any]:
    """The content of a JSON file without its digest."""
    content: dict[str, Any] = json.loads(path.read_text())
    return {name: value for name, value in content.items() if name != "sha256"}


def write_json(path: Path, content: Any) -> None:
    """Write any JSON, also with NaN, and its digest."""
    path.write_text(insert_digest(json.dumps(content, indent=1) + "\n"))


def rewrite_json(path: Path, **changes: Any) -> None:
    """Change keys of a JSON file; its digest fits afterwards."""
    write_json(path, {**read_json(path), **changes})


def rewrite_digests(out: Path) -> None:
    """Make the digests in the index of a run fit its files."""
    with CellIndex(out) as index:
        index.write_digest(compute_digests(out))
