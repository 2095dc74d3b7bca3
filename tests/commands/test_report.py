"""`harness report` of a sweep checks every cell before it writes a page."""

from pathlib import Path

import pytest

from harness.report.sweep import page
from harness.results import CellIndex
from harness.results.files import compute_digests
from tests.command import Command
from tests.planted import Plan, planted_run


@pytest.mark.parametrize("damaged", [False, True])
def test_a_damaged_cell_of_a_sweep_is_refused(
    damaged: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    out = planted_run(tmp_path / "sweep", Plan(behaviours=("walking",), takes=1, methods={"ik": 2.0}))
    with CellIndex(out) as index:
        index.note(kind="sweep")
        index.write_digest(compute_digests(out))
    monkeypatch.setattr(page, "write_sweep_page", lambda out: out / "report.html")
    if damaged:
        (frames,) = out.glob("cells/*/frames.npz")
        frames.write_bytes(frames.read_bytes()[:-1])
    assert ("frames.npz: damaged or edited" in command("report", out, code=2 if damaged else 0).err) is damaged
