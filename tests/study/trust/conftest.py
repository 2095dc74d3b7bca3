"""A small trust study: six short clips of built-in motion, recorded as a device would send them."""

import csv
from dataclasses import dataclass
from pathlib import Path

import pytest

from harness.experiment import prepare_playback
from harness.stream.recording import RecordingStream, record_capture
from harness.study.trust.plan import plan_digest

CLIPS = ("walking_p1_01", "walking_p2_01", "boxing_p1_01", "boxing_p2_01", "jumping_p1_01", "golf_p1_01")
SCENARIO = f"""
schema = 1
methods = ["ik"]
stations = "liu2011"
[motion]
source = "builtin"
body = "common"
longest_s = 3.0
behaviours = ["mixed"]
test = {list(CLIPS)}
examples = ["walking_p1_02", "boxing_p1_02"]
"""
PLAN = """
kind = "trust plan"
scenario = "small.toml"
methods = ["mean_pose", "best_match", "ik:previous"]
seeds = [1, 2]
[margins]
joint_angle_mean_deg = 20.0
mpjpe_mm = 200.0
[stations]
all = ["head", "torso", "left_hand", "right_hand", "left_ankle", "right_ankle"]
four = ["left_hand", "right_hand", "torso", "head"]
"""


@dataclass(frozen=True)
class SmallStudy:
    """The files of the study."""

    plan: Path
    captures: list[Path]

    def another_plan(self, name: str, old: str = "", new: str = "") -> Path:
        """The plan with a change, in a file beside it."""
        assert old in PLAN
        path = self.plan.with_name(name)
        path.write_text(PLAN.replace(old, new) if old else PLAN, encoding="utf-8")
        return path


@pytest.fixture(scope="session")
def small_study(tmp_path_factory: pytest.TempPathFactory) -> SmallStudy:
    """The study, with captures that carry the digest of its plan."""
    folder = tmp_path_factory.mktemp("trust")
    (folder / "small.toml").write_text(SCENARIO, encoding="utf-8")
    plan = folder / "plan.toml"
    plan.write_text(PLAN, encoding="utf-8")
    note, captures = {"scenario": "small", "plan": plan_digest(plan), "rate_hz": 40.0, "seed": 1}, []
    for clip in CLIPS:
        simulation = prepare_playback(folder / "small.toml", clip=clip).simulation
        captures.append(folder / f"{clip}.rec")
        record_capture(captures[-1], simulation.wire_format, simulation.wire, {**note, "clip": clip})
    return SmallStudy(plan, captures)


def write_log(capture: Path, path: Path) -> Path:
    """The poses of a capture as a table in millimetres, an hour later."""
    stream = RecordingStream(capture)
    rows = [
        [frame.measured_s[n] + 3600.0, name, *(1e3 * frame.position_m[n]), *frame.tracker_from_station[n]]
        for frame in stream
        for n, name in enumerate(stream.stations)
        if frame.position_valid[n] and frame.orientation_valid[n]
    ]
    with path.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, delimiter=";").writerows([["time", "body", "x", "y", "z", "qw", "qx", "qy", "qz"], *rows])
    return path
