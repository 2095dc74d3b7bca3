"""The names that `import harness` offers."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import harness
from tests.short_demo import short_demo


def test_every_public_name_is_there_and_explained() -> None:
    for name in harness.__all__:
        assert getattr(harness, name)
        assert name == "__version__" or f"| `{name}`" in str(harness.__doc__)
        assert name == "__version__" or getattr(harness, name).__doc__
    assert set(harness.__all__) <= set(dir(harness))
    with pytest.raises(AttributeError, match="frobnicate"):
        harness.frobnicate  # type: ignore[attr-defined]  # noqa: B018


def test_importing_the_package_imports_nothing_heavy() -> None:
    code = "import sys, harness; print(sorted({m.split('.')[0] for m in sys.modules}))"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert not {f"'{heavy}'" for heavy in ("numpy", "mujoco", "scipy")} & set(loaded.strip("[]\n").split(", "))


def test_a_run_is_loaded_cell_by_cell_and_as_a_table(tmp_path: Path) -> None:
    from dataclasses import replace

    scenario = harness.load_scenario(short_demo(tmp_path / "short.toml"))
    motion = replace(scenario.motion, test=scenario.motion.test[:2], behaviours=scenario.motion.behaviours[:2])
    scenario = replace(scenario, methods=("mean_pose", "ik"), motion=motion)
    assert harness.run(scenario, tmp_path / "run").word == "pass"
    run = harness.load(tmp_path / "run")
    assert [(record.method, record.clip) for record in run.records] == [
        (method, clip) for clip in motion.test for method in scenario.methods
    ]
    (cell,) = run.cells(method="ik", clip=motion.test[0])
    assert cell.errors["joint_angle_mean_deg"].shape == cell.time_s.shape
    with pytest.raises(harness.HarnessError, match="no field 'clp'"):
        run.cells(clp="walking_p1_01")
    comparison = harness.compare_runs(tmp_path / "run", methods=("ik", "ik"))
    assert comparison.matched == 2
    table = pytest.importorskip("pandas") and run.to_pandas()
    assert list(table["method"]) == [record.method for record in run.records]
    assert table["joint_angle_mean_deg"].iloc[1] == run.records[1].metrics["joint_angle_mean_deg"]


def test_a_table_without_pandas_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from harness.results import LoadedRun, Manifest, ResultSet

    monkeypatch.setitem(sys.modules, "pandas", None)
    empty = LoadedRun(tmp_path, ResultSet("none", Manifest({}, {}, {}), (), 0))
    with pytest.raises(harness.HarnessError, match=r"tracker-harness\[pandas\]"):
        empty.to_pandas()


def test_a_clip_of_the_motion_generator_is_simulated() -> None:
    from harness.mocap import synthetic

    clip = synthetic.generate("walking", "p1", 1, seed=1)
    simulation = harness.simulate_clip(clip)
    assert simulation.stations == tuple(harness.load_scenario("demo").stations)
    assert len(simulation.frames) > 0.9 * simulation.expected
    assert np.isfinite(simulation.truth_qpos).all()
