"""Validation of planted captures against their true motion, as `harness validate CAPTURE --truth CLIP` does it."""

from pathlib import Path

import numpy as np

from harness.bench.lab.captures import EARLIER, planted_capture, planted_motion, planted_scenario
from harness.body.kinematics import bone_poses
from harness.body.retargeting import retarget_to_own_body
from harness.core.humanoid24 import BONES
from harness.experiment.clip_evaluation import mounts_of, tracker_of
from harness.measure.pose_series import TruthPoses
from harness.simulate.simulation import exact_calibration
from harness.study.trust.truth_motion import TruthMotion, nominal_mounts
from harness.study.trust.validation import Validation, session_unit, validate_capture


def validate_planted(kind: str, seed: int, folder: Path) -> Validation:
    """Record a planted capture and validate it; a scale is compared with an earlier capture of the session."""
    expected = None
    if kind == "scale":
        earlier = validate_capture(planted_capture(EARLIER, seed, folder), planted_truth(EARLIER, seed))
        expected = session_unit(earlier, None, EARLIER)
    return validate_capture(planted_capture(kind, seed, folder), planted_truth(kind, seed), expected=expected)


def planted_truth(kind: str, seed: int) -> TruthMotion:
    """The reference of a capture: the performer's bones, with stations where the scenario without a fault has them."""
    scenario, clip = planted_scenario(EARLIER, seed), planted_motion(kind, seed)
    body, take = retarget_to_own_body(clip)
    calibration = exact_calibration(body, mounts_of(scenario), tracker_of(scenario))
    position_m, world_from_bone = bone_poses(body.skeleton, take.qpos)
    time_s, rows = np.arange(len(take)) / take.rate_hz, {bone: BONES.index(bone) for bone in calibration.bones}
    return TruthMotion(
        f"clip {clip.name}, {time_s[-1]:.1f} s",
        {bone: TruthPoses(time_s, position_m[:, row], world_from_bone[:, row]) for bone, row in rows.items()},
        dict(zip(calibration.stations, calibration.bones, strict=True)),
        nominal_mounts(calibration, calibration.stations),
        host_clock=True,
    )
