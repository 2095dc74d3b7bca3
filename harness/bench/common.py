"""What benchmarks share: six stations, their calibration in the world frame, and cells of scenarios in a folder."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.body import DEFAULT_MOUNTS, Body, Kinematics
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.experiment import BatchResults, check_names, clear_caches, run_cells
from harness.experiment.methods import close_methods
from harness.experiment.scenarios import Scenario
from harness.mocap import LibraryFolders
from harness.results import open_study
from harness.simulate import TrackerConfig, exact_calibration

STATIONS = ("left_wrist", "right_wrist", "left_ankle", "right_ankle", "torso", "head")
"""Stations of the first paper (Liu et al. 2011)."""
MOUNTS = tuple(DEFAULT_MOUNTS[station] for station in STATIONS)


def world_calibration(body: Body) -> Calibration:
    """The exact calibration of the six stations, with the world frame as the tracker's."""
    return in_world(exact_calibration(body, MOUNTS, TrackerConfig()))


def in_world(calibration: Calibration) -> Calibration:
    """A calibration with the world frame as the tracker's."""
    return replace(calibration, world_from_tracker=rotations.IDENTITY, tracker_origin_m=np.zeros(3))


def pose_all(body: Body, poses: Floats) -> None:
    """MuJoCo's bare kinematics of configurations (T, 55)."""
    kinematics = Kinematics(body)
    for qpos in poses:
        kinematics.set(qpos)


@contextmanager
def fresh_methods() -> Iterator[None]:
    """Nothing that was loaded before is used in the block, and processes of methods end with it."""
    clear_caches()  # files may have changed since the last run
    try:
        yield
    finally:
        close_methods()


def run_benchmark_cells(
    name: str,
    scenarios: Sequence[Scenario],
    out: Path,
    *,
    folder: LibraryFolders | None = None,
    command: str = "",
    **options: Any,
) -> BatchResults:
    """Run or resume the cells of a benchmark in `out`, with the options of `engine.run_cells`.

    `folder` is the library of real motion, by default HARNESS_MOCAP. BadInput without one, and for a folder that holds
    something else.
    """
    check_names(scenarios, folder)
    with open_study(out, {"benchmark": name}):
        (out / "cells").mkdir(exist_ok=True)
        return run_cells(scenarios, out, folder=folder, command=command, **options)
