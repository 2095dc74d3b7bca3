"""Station kinematics of several poses: against body kinematics, and Jacobians against finite differences."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from harness.calibrate.station_kinematics import StationKinematics, StationPoses
from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.core.humanoid24 import standard_skeleton
from harness.core.skeleton import forward_kinematics

POSES, STEP = 3, 1e-6
BONES = ("lwrist", "rhand", "ltibia", "thorax", "head", "lhipjoint")


@dataclass(eq=False)
class State:
    """Arguments of the forward kinematics."""

    bone_m: Floats
    root_m: Floats
    root: Floats
    angles_rad: Floats
    mount_m: Floats
    stations: Floats

    @classmethod
    def random(cls, rng: np.random.Generator) -> "State":
        return cls(
            bone_m=standard_skeleton().bone_m + 0.02 * rng.normal(size=(24, 3)),
            root_m=rng.normal(size=(POSES, 3)),
            root=rotations.exp(rng.normal(size=(POSES, 3))),
            angles_rad=rng.normal(size=(POSES, 48)),
            mount_m=0.1 * rng.normal(size=(len(BONES), 3)),
            stations=rotations.exp(rng.normal(size=(len(BONES), 3))),
        )


SKELETON = standard_skeleton()
CARRIERS: Ints = np.array([SKELETON.index(bone) for bone in BONES])
CHAIN = StationKinematics(SKELETON, CARRIERS)


def reach(state: State) -> StationPoses:
    root, stations = rotations.to_matrix(state.root), rotations.to_matrix(state.stations)
    return CHAIN.forward_kinematics(state.bone_m, state.root_m, root, state.angles_rad, state.mount_m, stations)


def slopes(change: Callable[[float], State]) -> tuple[Floats, Floats]:
    """Derivatives of positions (P, S, 3) and rotations (P, S, 3) by central differences."""
    ahead, behind = reach(change(STEP)), reach(change(-STEP))
    turn = ahead.world_from_station @ np.swapaxes(behind.world_from_station, -1, -2)
    return (
        (ahead.place_m - behind.place_m) / (2.0 * STEP),
        rotations.log(rotations.from_matrix(turn)) / (2.0 * STEP),
    )


def test_bones_are_where_plain_kinematics_has_them(rng: np.random.Generator) -> None:
    state = State.random(rng)
    found = reach(state)
    plain = forward_kinematics(SKELETON.with_bones(state.bone_m), state.root_m, state.root, state.angles_rad)
    np.testing.assert_allclose(found.world_from_bone, plain.world_from_bone, atol=1e-12)
    np.testing.assert_allclose(found.joint_m, plain.start_m, atol=1e-12)
    expected = plain.start_m[:, CARRIERS] + (plain.world_from_bone[:, CARRIERS] @ state.mount_m[..., None])[..., 0]
    np.testing.assert_allclose(found.place_m, expected, atol=1e-12)


@pytest.mark.parametrize("dof", range(48))
def test_hinges(dof: int, rng: np.random.Generator) -> None:
    state = State.random(rng)
    place, turn = (slope[..., dof] for slope in CHAIN.hinge_jacobian(reach(state)))

    def change(step: float) -> State:
        return State(**{**vars(state), "angles_rad": state.angles_rad + step * np.eye(48)[dof]})

    np.testing.assert_allclose(place, slopes(change)[0], atol=1e-8)
    np.testing.assert_allclose(turn, slopes(change)[1], atol=1e-8)
    assert np.any(turn != 0.0) == CHAIN.hinge_turns_station[:, dof].any()


@pytest.mark.parametrize("axis", range(6))
def test_roots(axis: int, rng: np.random.Generator) -> None:
    state, unit = State.random(rng), np.eye(6)[axis]
    place, turn = (slope[..., axis] for slope in CHAIN.root_jacobian(reach(state)))

    def change(step: float) -> State:
        root = rotations.multiply(rotations.exp(step * unit[3:]), state.root)
        return State(**{**vars(state), "root_m": state.root_m + step * unit[:3], "root": root})

    np.testing.assert_allclose(place, slopes(change)[0], atol=1e-8)
    np.testing.assert_allclose(turn, slopes(change)[1], atol=1e-8)


@pytest.mark.parametrize("bone", range(24))
def test_bones(bone: int, rng: np.random.Generator) -> None:
    state, along = State.random(rng), rng.normal(size=3)
    place = CHAIN.bone_jacobian(reach(state), np.array([bone]), along[None])[..., 0]

    def change(step: float) -> State:
        return State(**{**vars(state), "bone_m": state.bone_m + step * np.eye(24)[bone][:, None] * along})

    np.testing.assert_allclose(place, slopes(change)[0], atol=1e-8)
    assert np.all(slopes(change)[1] == 0.0)


@pytest.mark.parametrize("axis", range(3))
def test_mounts(axis: int, rng: np.random.Generator) -> None:
    state = State.random(rng)

    def change(step: float) -> State:
        return State(**{**vars(state), "mount_m": state.mount_m + step * np.eye(3)[axis]})

    np.testing.assert_allclose(CHAIN.mount_jacobian(reach(state))[..., axis], slopes(change)[0], atol=1e-8)
