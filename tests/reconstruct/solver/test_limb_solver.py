"""Limbs in closed form: they reach what can be reached, keep their limits, and leave alone what is not measured."""

import numpy as np
import pytest

from harness.body import build_body, tpose
from harness.core.arrays import Floats
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.limb_solver import LimbSolver
from harness.reconstruct.solver.residuals import Loss, Residuals
from harness.testing.frames import drop_stations, exact_calibration, exact_frames

BODY = build_body()
JOINTS = [BODY.model.joint(j + 1).name for j in range(48)]
LIMBS = np.array([any(b in name for b in ("humerus", "radius", "wrist", "hand")) for name in JOINTS])
LIMBS |= np.array([any(b in name for b in ("femur", "tibia", "foot")) for name in JOINTS])
BENDS = [JOINTS.index(f"{bone}.rx") for bone in ("lradius", "rradius", "ltibia", "rtibia")]
LOW, HIGH = BODY.model.jnt_range[1:].T
SETS = {
    "hands and feet": ("left_hand", "right_hand", "left_foot", "right_foot", "pelvis"),
    "wrists and chest": ("left_wrist", "right_wrist", "left_foot", "right_foot", "torso"),
    "ankles": ("left_hand", "right_hand", "left_ankle", "right_ankle", "pelvis"),
}


class Bench:
    """A body on the trackers of a known pose."""

    def __init__(self, stations: tuple[str, ...], keep: bool) -> None:
        self.calibration = exact_calibration(BODY, stations)
        self.residuals = Residuals(BODY, self.calibration, Loss())
        self.limits = HingeLimits(BODY, keep=keep)
        self.limbs = LimbSolver(BODY, self.calibration.bones, self.residuals, self.limits)

    def reached(self, truth: Floats, guess: Floats, lost: tuple[int, ...] = ()) -> Floats:
        self.residuals.read(drop_stations(exact_frames(BODY, self.calibration, truth[None])[0], lost))
        out = self.limbs.solve(guess)
        self.residuals.evaluate(out)
        return out


def poses(rng: np.random.Generator, spread: float) -> tuple[Floats, Floats]:
    """A pose (55,), and the same with another trunk place and other limbs."""
    truth = tpose(BODY.skeleton)
    truth[7:] = rng.uniform(np.maximum(LOW, -1.0), np.minimum(HIGH, 1.0))
    truth[7:][BENDS] = rng.uniform(0.3, 1.0, 4)  # a distance alone does not say which way a straight limb bends
    guess = truth.copy()
    guess[:3] += 0.1
    guess[7:][LIMBS] += spread * rng.normal(size=int(LIMBS.sum()))
    return truth, guess


@pytest.mark.parametrize("stations", SETS.values(), ids=SETS.keys())
def test_what_can_be_reached_is_reached(rng: np.random.Generator, stations: tuple[str, ...]) -> None:
    bench = Bench(stations, keep=False)
    for _ in range(30):
        bench.reached(*poses(rng, 0.1))
        assert bench.residuals.distance.max() < 1e-7  # rotation vectors come out of arc tangents
        np.testing.assert_allclose(bench.residuals.station_m, bench.residuals.target_m, atol=1e-9)


@pytest.mark.parametrize("stations", SETS.values(), ids=SETS.keys())
def test_limits_are_kept(rng: np.random.Generator, stations: tuple[str, ...]) -> None:
    bench = Bench(stations, keep=True)
    for _ in range(30):
        truth, _ = poses(rng, 0.0)
        _, guess = poses(rng, 0.0)  # somebody else's: mostly out of reach
        out = bench.reached(truth, guess)
        assert bench.limits.excess_rad(out[7:]).max() < 1e-12


def test_a_point_too_far_away_straightens_the_limb(rng: np.random.Generator) -> None:
    bench = Bench(("left_hand", "pelvis"), keep=False)
    truth, _ = poses(rng, 0.0)
    bench.residuals.read(exact_frames(BODY, bench.calibration, truth[None])[0])
    bench.residuals.target_m[0] += [0.0, 5.0, 0.0]
    out = bench.limbs.solve(truth)
    assert abs(out[7 + JOINTS.index("lradius.rx")]) < 1e-6


def test_the_right_pose_is_left_as_it_is(rng: np.random.Generator) -> None:
    bench = Bench(SETS["hands and feet"], keep=False)
    truth, _ = poses(rng, 0.0)
    np.testing.assert_allclose(bench.reached(truth, truth), truth, atol=1e-6)


def test_a_limb_without_readings_stays(rng: np.random.Generator) -> None:
    bench = Bench(SETS["hands and feet"], keep=False)
    truth, guess = poses(rng, 0.2)
    out = bench.reached(truth, guess, lost=(0, 3))
    still = np.array(
        [name.startswith(("lhumerus", "lradius", "lwrist", "lhand", "rfemur", "rtibia", "rfoot")) for name in JOINTS]
    )
    np.testing.assert_array_equal(out[7:][still], guess[7:][still])
    assert not np.allclose(out[7:][LIMBS & ~still], guess[7:][LIMBS & ~still])


def test_the_pose_that_was_evaluated_before_does_not_matter(rng: np.random.Generator) -> None:
    truth, guess = poses(rng, 0.1)
    bench = Bench(SETS["wrists and chest"], keep=False)
    once = bench.reached(truth, guess)
    bench.residuals.evaluate(tpose(BODY.skeleton))
    np.testing.assert_allclose(bench.limbs.solve(guess), once, atol=1e-9)
