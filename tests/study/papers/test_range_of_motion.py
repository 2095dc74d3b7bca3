"""Ranges of motion: those of made-up angles are known, and frames that nothing is learnt from have no say."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.core.humanoid24 import standard_skeleton
from harness.core.motion import Clip
from harness.study.papers import range_of_motion
from harness.study.papers.kim2012 import PAPER
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.range_of_motion import LIMBS, measure_ranges

WIDTHS_DEG = {"rfemur.rx": 40.0, "rtibia.rx": 60.0, "lfemur.rx": 50.0, "rradius.rx": 90.0, "lhumerus.rx": 30.0}


class Ramps:
    """Every clip sweeps the hinges of `WIDTHS_DEG` evenly; the second half of each has ten times the range."""

    def load(self, name: str) -> Clip:
        skeleton, frames = standard_skeleton(), 1200
        ramp = np.concatenate([np.linspace(0.0, 1.0, 600), np.linspace(0.0, 10.0, 600)])
        angles = np.zeros((frames, len(skeleton.dof_names)))
        for hinge, width in WIDTHS_DEG.items():
            angles[:, skeleton.dof_names.index(hinge)] = np.deg2rad(width) * ramp
        turned = np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1))
        return Clip(name, "p", "ramps", "walking", skeleton, 120.0, np.zeros((frames, 3)), turned, angles)


def test_a_limb_has_the_central_95_percent_of_its_most_movable_hinge(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(range_of_motion, "open_scenario_motion", lambda *_: Ramps())
    scenario = PAPER.plan("builtin", 1)["sensors_walking"]
    motion = replace(scenario.motion, examples=("a", "b"), withheld=("a@0.50-1.00", "b@0.50-1.00"))
    study = PaperStudy(tmp_path, "builtin", 1, {"sensors_walking": replace(scenario, motion=motion)})
    kept = (600 - 120 - 1) / 599  # the guard time before the withheld half
    wanted = {"right_hand": 90.0, "left_hand": 30.0, "right_ankle": 60.0, "left_ankle": 50.0, "pelvis": 0.0}
    found = measure_ranges(study, "sensors_walking")
    assert found.keys() == set(LIMBS)
    assert found == pytest.approx({name: 0.95 * kept * width for name, width in wanted.items()}, rel=1e-3)


def test_hands_move_most_in_bouts(tmp_path: Path) -> None:
    scenario = PAPER.plan("builtin", 1)["sensors_boxing"]
    motion = replace(scenario.motion, examples=scenario.motion.examples[:2], withheld=())
    study = PaperStudy(tmp_path, "builtin", 1, {"sensors_boxing": replace(scenario, motion=motion)})
    ranges = measure_ranges(study, "sensors_boxing")
    assert set(sorted(ranges, key=lambda name: -ranges[name])[:2]) == {"right_hand", "left_hand"}
