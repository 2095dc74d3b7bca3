"""Computes the digests of changed result files again, as somebody would who wants to deceive."""

import contextlib
import hashlib
import json
import sqlite3
from pathlib import Path
from typing import Any

from harness.core.toml_file import insert_toml_digest
from harness.results.files import compute_digests, insert_digest
from harness.results.index import _content_digest


def _mend_json(path: Path, **digests: Any) -> None:
    """Put `digests` and the digest of the text itself into a JSON object; other content stays as it is."""
    try:
        content = json.loads(path.read_bytes())
    except (ValueError, RecursionError):
        return
    if isinstance(content, dict):
        content.pop("sha256", None)
        path.write_text(insert_digest(json.dumps({**content, **digests}, indent=1)), encoding="utf-8")


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def mend_run(folder: Path) -> None:
    """Mend a run in `folder`/x: cells, manifest, summary, index."""
    run = folder / "x"
    for cell in (run / "cells").iterdir():
        _mend_json(cell / "cell.json", frames_sha256=_sha256(cell / "frames.npz"))
    _mend_json(run / "manifest.json")
    _mend_json(run / "summary.json")
    mend_index(folder)


def mend_index(folder: Path) -> None:
    """Mend the digests in the index of `folder`/x."""
    run = folder / "x"
    db = sqlite3.connect(run / "index.sqlite")
    with contextlib.suppress(sqlite3.DatabaseError, UnicodeDecodeError, OverflowError), db:
        if db.execute("SELECT 1 FROM digests WHERE file = 'index.sqlite'").fetchone():
            digests = compute_digests(run) if (run / "summary.json").exists() else {}
            db.executemany("INSERT OR REPLACE INTO digests VALUES (?, ?)", digests.items())
            db.execute("INSERT OR REPLACE INTO digests VALUES (?, ?)", ("index.sqlite", _content_digest(db)))
    db.close()


def mend_baseline(folder: Path) -> None:
    """Mend a baseline in `folder`/b."""
    names = ("manifest.json", "summary.json")
    for name in names:
        _mend_json(folder / "b" / name)
    _mend_json(folder / "b" / "cells.json", digests={name: _sha256(folder / "b" / name) for name in names})


def mend_calibration(folder: Path) -> None:
    """Mend the digest in the first line of `folder`/x.toml, also where that line is damaged or gone."""
    path = folder / "x.toml"
    lines = path.read_text(encoding="utf-8", errors="surrogateescape").splitlines(keepends=True)
    rest = "".join(line for line in lines if not line.startswith("sha256"))
    with contextlib.suppress(UnicodeEncodeError):  # bytes that no text has: refused in any case
        path.write_text(insert_toml_digest(rest), encoding="utf-8")


def mend_findings(folder: Path) -> None:
    """Mend findings.json in `folder`."""
    _mend_json(folder / "findings.json")
