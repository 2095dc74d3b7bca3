"""Motion that is written down here, so that every score has a value worked out by hand."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.core.arrays import Floats, Ints
from harness.core.estimate import Status
from harness.core.humanoid24 import pack, standard_skeleton
from harness.results import Cell, cell_key
from harness.results.cell import IDENTITY
from harness.score import Scores, score_estimate

RATE_HZ = 40.0
FRAMES = 400

Judge = Callable[..., Scores]


@pytest.fixture
def truth_qpos(rng: np.random.Generator) -> Floats:
    """(400, 55) smooth motion of all hinges within a radian, walking forward and turning; 10 s at 40 Hz."""
    t = np.arange(FRAMES)[:, None] / RATE_HZ
    angles_rad = rng.uniform(-0.4, 0.4, 48) + 0.4 * np.sin(t * rng.uniform(1.0, 6.0, 48) + rng.uniform(0.0, 6.0, 48))
    root_m = np.concatenate([t, 0.1 * np.sin(t), 0.95 + 0.02 * np.cos(5.0 * t)], axis=1)
    turn = 0.25 * t
    quaternion = np.concatenate([np.cos(turn), np.zeros_like(t), np.zeros_like(t), np.sin(turn)], axis=1)
    return pack(root_m, quaternion, angles_rad)


@pytest.fixture
def judge(truth_qpos: Floats) -> Judge:
    """Scores of an estimate (F, 55) of the true motion, by default of every frame and without warm-up."""

    def judged(estimate_qpos: Floats, frame_index: Ints | None = None, **options: Any) -> Scores:
        index = np.arange(len(estimate_qpos)) if frame_index is None else frame_index
        status = np.full(len(index), Status.SOLVED)
        step_ms = np.full(len(index), 2.0)
        skeleton = standard_skeleton()
        options = {"warm_up_s": 0.0, **options}
        return score_estimate(skeleton, RATE_HZ, truth_qpos, estimate_qpos, index, status, step_ms, **options)

    return judged


@pytest.fixture
def make_cell(truth_qpos: Floats, judge: Judge) -> Callable[..., Cell]:
    """A cell whose estimate is off by some metres along x; other fields can be named."""

    def cell(off_m: float = 0.01, frames: int = FRAMES, **fields: object) -> Cell:
        estimate = truth_qpos[:frames].copy()
        estimate[:, 0] += off_m
        content: dict[str, Any] = {
            "method": "ik",
            "behaviour": "walking",
            "clip": "walk_01",
            "motion_source": "built-in performer",
            "stations": ("head", "torso"),
            "mount": "tibia",
            "rate_hz": RATE_HZ,
            "inputs": "pos+ori",
            "split": "none",
            "calibration": "exact",
            "noise": "clean",
            "seed": 1,
            "defined_by": {"noise": "clean", "clip": "walk_01", "off_m": off_m},
            "scores": judge(estimate, floor=0.0),
            "health": {"records": frames * 2, "lost": 3},
            "bone_m": standard_skeleton().bone_m,
            "source_hash": "0123456789abcdef",
            "reproduce": "harness run demo",
            "notes": ("a note",),
            "time_s": np.arange(frames) / RATE_HZ,
            "truth_qpos": truth_qpos[:frames],
            "estimate_qpos": estimate,
            "frame_index": np.arange(frames),
            "status": np.zeros(frames),
            "origin": np.zeros(frames),
            "step_ms": np.full(frames, 2.0),
            "quality": np.ones((frames, 2)),
            "position_valid": np.ones((frames, 2)),
            "orientation_valid": np.ones((frames, 2)),
            "suspect": np.zeros((frames, 2)),
        } | fields
        described = {name: content[name] for name in IDENTITY}
        key = cell_key(described, {"off_m": off_m, "frames": frames}, "source")
        return Cell(key=key, **content)

    return cell


@pytest.fixture
def run_folder(tmp_path: Path) -> Path:
    return tmp_path / "run"
