"""The examples run as they stand."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parent.parent / "examples"


def run(script: str, *words: str, cwd: Path) -> str:
    """What the script prints, run as a user does, with this checkout of the package."""
    path = os.pathsep.join(filter(None, (str(EXAMPLES.parent), os.environ.get("PYTHONPATH"))))
    ended = subprocess.run(
        [sys.executable, "-W", "error", EXAMPLES / script, *words],
        cwd=cwd,
        env=os.environ | {"PYTHONPATH": path},
        capture_output=True,
        text=True,
    )
    assert ended.returncode == 0, ended.stderr
    return ended.stdout


@pytest.mark.long
def test_a_scenario_is_run_and_read(tmp_path: Path) -> None:
    printed = run("run_and_read.py", "out", cwd=tmp_path)
    assert "outcome: pass" in printed
    assert len(re.findall(r"^\w+_p1_01 +\w+ +[\d.]+ deg$", printed, re.MULTILINE)) == 4
    assert len(re.findall(r"^ik is worst on \w+ after [\d.]+ s", printed, re.MULTILINE)) == 2


@pytest.mark.long
def test_a_method_of_ones_own_passes_its_gate(tmp_path: Path) -> None:
    printed = run("own_method.py", "out", cwd=tmp_path)
    assert "baseline: " in printed
    assert "B is no worse than A in 4 gated lines on 6 performers: 4 same, 0 better" in printed


@pytest.mark.long
def test_frames_are_read_from_an_emulated_device(tmp_path: Path) -> None:
    printed = run("read_stream.py", cwd=tmp_path)
    assert len(re.findall(r"^ +[\d.]+ s: head .* left_hand ", printed, re.MULTILINE)) == 40


def test_the_notebook_runs_cell_by_cell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its code cells, one after another in one namespace, without Jupyter."""
    import matplotlib

    content = json.loads((EXAMPLES / "first_look.ipynb").read_text(encoding="utf-8"))
    assert (content["nbformat"], content["nbformat_minor"]) == (4, 5)
    assert len({cell["id"] for cell in content["cells"]}) == len(content["cells"])
    assert not any(cell.get("outputs") for cell in content["cells"])
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    matplotlib.use("Agg")
    namespace: dict[str, object] = {}
    for cell in content["cells"]:
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), cell["id"], "exec"), namespace)  # noqa: S102  # a notebook does this
    from matplotlib import pyplot

    assert len(pyplot.get_fignums()) == 2
    pyplot.close("all")
