"""A posture stood where the readings are: exact readings of a body that was moved bring it back."""

import numpy as np
import pytest

from harness.body import build_body, tpose
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.humanoid24 import standard_skeleton
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.reconstruct.solver.root_placement import candidate_placements, starting_postures
from harness.stream import make_inputs
from harness.testing.frames import exact_calibration, exact_frames


def moved(qpos: Floats, turn: Floats, by_m: Floats) -> Floats:
    out = qpos.copy()
    out[:3] = rotations.rotate(turn, qpos[:3]) + by_m
    out[3:7] = rotations.multiply(turn, qpos[3:7])
    return out


@pytest.mark.parametrize("inputs", ["pos+ori", "pos", "ori"])
@pytest.mark.parametrize("tilt_rad", [0.0, 0.4, np.pi - 1e-3])
def test_a_body_that_was_moved_is_found(inputs: str, tilt_rad: float, rng: np.random.Generator) -> None:
    body = build_body(standard_skeleton())
    known = exact_calibration(body)
    residuals = Residuals(body, known, Loss())
    for posture in (tpose(body.skeleton), *starting_postures(body)):
        turn = rotations.multiply(
            rotations.about_z(rng.uniform(-np.pi, np.pi)), rotations.exp(np.array([0.0, tilt_rad, 0.0]))
        )
        there = moved(posture, turn, np.array([1.0, -2.0, 0.3]))
        residuals.read(make_inputs(inputs, known.stations).mask(exact_frames(body, known, there[None])[0]))
        upright, tilted = candidate_placements(residuals, posture)
        found = [tilted] if tilt_rad else [upright, tilted]
        for qpos in found:
            assert rotations.angle_between_rad(qpos[3:7], there[3:7]) < 1e-6
            if inputs != "ori":  # without positions it stays where it is
                np.testing.assert_allclose(qpos[:3], there[:3], atol=1e-6)
            np.testing.assert_array_equal(qpos[7:], posture[7:])
        leaned = rotations.rotate(
            rotations.multiply(upright[3:7], rotations.inverse(posture[3:7])), np.array([0.0, 0.0, 1.0])
        )
        np.testing.assert_allclose(
            leaned, [0.0, 0.0, 1.0], atol=1e-12, err_msg="upright is turned about the vertical alone"
        )
