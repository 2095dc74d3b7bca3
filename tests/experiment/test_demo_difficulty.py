"""What the demo's methods make of built-in motion: data helps threefold, and does not help completely."""

from dataclasses import replace
from pathlib import Path

import pytest

from harness.experiment import engine
from harness.experiment.scenario import load_scenario
from harness.mocap import synthetic
from harness.results.storage import read_summary

SLOW = ("boxing", "jumping", "golf")
"""Left to `make test-slow`: `mocap/test_performer_difficulty.py` asks the same of every behaviour, without the loop."""


@pytest.mark.parametrize(
    "behaviour", [pytest.param(b, marks=[pytest.mark.slow] if b in SLOW else []) for b in synthetic.BEHAVIOURS]
)
def test_the_mean_pose_errs_three_times_as_much_as_what_was_learnt(tmp_path: Path, behaviour: str) -> None:
    """Perfect trackers and the reference performers, through the whole loop of the demo."""
    demo = load_scenario("demo")
    examples = tuple(f"{behaviour}_{take}" for take in ("p1_02", "p1_03", "p2_01", "p3_01"))
    motion = replace(
        demo.motion, test=(f"{behaviour}_p1_01",), behaviours=(behaviour,), examples=examples, longest_s=8.0
    )
    methods = ("mean_pose", "kernel_ridge", "kernel_ridge+ik")
    engine.run(replace(demo, motion=motion, noise="clean", methods=methods), tmp_path / "run")
    rows = read_summary(tmp_path / "run")["cells"]
    mean, *learnt = (row["joint_angle_mean_deg"] for row in rows)
    for error in learnt:
        assert 0.5 < error < 4.0
        assert mean > 3.0 * error
