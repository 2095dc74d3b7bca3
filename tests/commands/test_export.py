"""`harness export` as a user meets it: every format, filters, and refusals with the names that are known."""

from pathlib import Path

import numpy as np
import pytest

from harness.body import DEFAULT_MOUNTS, locate_mount
from harness.cli import main
from harness.commands import export
from harness.core.humanoid24 import standard_skeleton
from harness.mocap.write import EXPORT_FORMATS
from harness.results import select_cells
from tests.command import Command
from tests.mocap.write.glb_file import read_glb
from tests.short_demo import short_demo


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The short demo with two methods: ten cells."""
    folder = tmp_path_factory.mktemp("export")
    scenario, out = short_demo(folder / "short.toml"), folder / "run"
    assert main(["run", str(scenario), "--methods", "ik,mean_pose", "--no-report", "--out", str(out)]) == 0
    return out


def test_help_names_every_format() -> None:
    assert export._FORMATS == EXPORT_FORMATS


@pytest.mark.parametrize("fmt", EXPORT_FORMATS)
def test_every_format_is_written_for_the_chosen_cells(run: Path, tmp_path: Path, command: Command, fmt: str) -> None:
    words = ["--clip", "walking_*,golf_p1_01", "--clip", "boxing_p?_01", "--method", "ik", "--json"]
    files = command("export", run, "--format", fmt, "--out", tmp_path / "out", *words).content["files"]
    assert len(files) == {"glb": 3, "tum": 36}.get(fmt, 6)
    assert sorted(files) == sorted(str(file) for file in (tmp_path / "out").iterdir())
    assert all(Path(file).suffix == f".{fmt}" for file in files)
    assert {Path(file).name.split("-")[0] for file in files} == {"walking_p1_01", "golf_p1_01", "boxing_p1_01"}
    assert not [file for file in files if "mean_pose" in file]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--clip", "run_*"], "no clip called 'run_*'"),
        (["--method", "ik,dynamic_map"], "Known: ik, mean_pose."),
        (["--method", "ik,"], "--method 'ik,' names no method"),
        (["--method", "ik[a=1"], "brackets or quotes do not match"),
    ],
)
def test_what_matches_nothing_is_refused(
    run: Path, tmp_path: Path, command: Command, words: list[str], said: str
) -> None:
    assert said in command("export", run, "--format", "csv", "--out", tmp_path / "out", *words, code=2).err
    assert not (tmp_path / "out").exists()


def test_stations_are_at_their_nominal_mounts(run: Path, tmp_path: Path) -> None:
    """In the axes of their bones, on a body with the performer's proportions."""
    words = ["--clip", "walking_p1_01", "--method", "ik"]
    assert main(["export", str(run), "--format", "glb", "--out", str(tmp_path), *words]) == 0
    glb = read_glb(next(tmp_path.glob("*.glb")))
    cell = next(cell for cell in select_cells(run) if cell.method == "ik" and cell.clip == "walking_p1_01")
    stations = [node["name"] for node in glb.content["nodes"] if node["name"].startswith("truth station ")]
    assert sorted(stations) == sorted(f"truth station {name}" for name in cell.stations)
    skeleton = standard_skeleton().with_bones(cell.bone_m)
    for name in cell.stations:
        position_m, (w, x, y, z) = locate_mount(skeleton, DEFAULT_MOUNTS[name])
        node = glb.content["nodes"][glb.node(f"truth station {name}")]
        np.testing.assert_allclose(node["translation"], position_m, atol=1e-9)
        np.testing.assert_allclose(node["rotation"], [x, y, z, w], atol=1e-9)
        above = glb.content["nodes"][glb.node(f"truth {DEFAULT_MOUNTS[name].bone}")]
        assert glb.node(f"truth station {name}") in above["children"]
