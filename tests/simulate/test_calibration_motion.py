"""Motions of held poses, and random mounts."""

import numpy as np
import pytest

from harness.body import DEFAULT_MOUNTS, Body, build_body, locate_mount, pose_from_qpos, sole_heights_m, tpose
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.seeds import generator
from harness.errors import BadInput
from harness.mocap import synthetic
from harness.simulate.calibration_motion import hold_poses, hold_times_s
from harness.simulate.components.mount import perturb_mounts
from harness.simulate.link import TrackerConfig
from harness.simulate.noise import Noise, noise_preset
from harness.simulate.simulation import simulate_tracker
from harness.stream import TrackerFrame

COUNT = 8
SIX = [DEFAULT_MOUNTS[name] for name in ("left_hand", "right_hand", "left_ankle", "right_ankle", "torso", "head")]


@pytest.fixture(scope="module")
def body() -> Body:
    return build_body(synthetic.performer_skeleton("p2"))


def poses(body: Body) -> list[Floats]:
    """The T-pose and other configurations."""
    out, rng = [tpose(body.skeleton)], generator(1, "poses")
    for _ in range(COUNT - 1):
        pose = np.array(out[0])
        pose[7:] += rng.normal(0.0, 0.3, 48)
        out.append(pose)
    return out


def test_each_pose_is_held_without_moving(body: Body) -> None:
    take = hold_poses(body, poses(body), miss_rad=0.05, rng=generator(1, "miss"), hold_s=2.0, move_s=1.0)
    times_s = np.arange(len(take)) / take.rate_hz
    assert times_s[-1] == pytest.approx(COUNT * 3.0 - 1.0)
    still = np.zeros(len(take), dtype=bool)
    for begin_s, end_s in hold_times_s(COUNT, 2.0, 1.0):
        held = take.qpos[(times_s >= begin_s - 1e-9) & (times_s <= end_s + 1e-9)]
        np.testing.assert_allclose(held, np.broadcast_to(held[0], held.shape), atol=1e-12)
        still |= (times_s >= begin_s - 1e-9) & (times_s <= end_s + 1e-9)
        soles_m = sole_heights_m(body.skeleton, pose_from_qpos(body.skeleton, held[:1]))
        assert soles_m.min() == pytest.approx(0.0, abs=1e-12)
    assert (np.abs(np.diff(take.qpos, axis=0)).max(axis=1)[~still[:-1] & ~still[1:]] > 0.0).all()


def test_nothing_jumps_between_two_poses(body: Body) -> None:
    take = hold_poses(body, poses(body), miss_rad=0.05, rng=generator(1, "miss"))
    farthest_rad = float(np.abs(np.diff([take.qpos[round(120.0 * b)] for b, _ in hold_times_s(COUNT)], axis=0)).max())
    assert np.abs(np.diff(take.qpos[:, 7:], axis=0)).max() < 1.9 * farthest_rad / (1.5 * 120.0)


def test_who_misses_nothing_holds_the_poses_themselves(body: Body) -> None:
    meant = poses(body)
    take = hold_poses(body, meant, miss_rad=0.0, rng=generator(1, "miss"))
    held = [take.qpos[round(120.0 * begin_s)] for begin_s, _ in hold_times_s(COUNT)]
    np.testing.assert_allclose(held[0], meant[0], atol=1e-5)  # `tpose` stands on its ankles, not on its soles
    for found, pose in zip(held, meant, strict=True):
        np.testing.assert_allclose(found[7:], pose[7:], atol=1e-12)
    assert all(np.linalg.norm(found[:2]) > 0.0 for found in held[1:])


def test_every_hinge_and_the_lean_have_the_given_error(body: Body) -> None:
    meant = poses(body)[0]
    take = hold_poses(body, [meant] * 60, miss_rad=0.04, rng=generator(1, "miss"), hold_s=0.1, move_s=0.1)
    held = np.array([take.qpos[round(120.0 * begin_s)] for begin_s, _ in hold_times_s(60, 0.1, 0.1)])
    off = held[:, 7:] - meant[7:]
    assert off.std() == pytest.approx(0.04, rel=0.05)  # 2880 draws: 5 % is 3.8 standard deviations
    up = rotations.rotate(held[:, 3:7], np.array([0.0, 0.0, 1.0]))
    assert np.sqrt(np.mean(up[:, :2] ** 2)) == pytest.approx(0.04, rel=0.25)
    assert np.abs(rotations.yaw_rad(held[1:, 3:7])).max() > 0.0


def test_nothing_to_hold_is_refused(body: Body) -> None:
    with pytest.raises(BadInput, match="one pose"):
        hold_poses(body, [], miss_rad=0.0, rng=generator(1, "miss"))


def tracked(body: Body, session: str, noise: Noise, pose: Floats) -> tuple[TrackerFrame, ...]:
    take = hold_poses(body, [pose], miss_rad=0.0, rng=generator(1, "miss"), hold_s=1.0)
    return simulate_tracker(body, take, SIX, TrackerConfig(slot_s=0.0), noise, seed=3, session=session).frames


def test_takes_of_one_session_share_what_lasts_for_one(body: Body) -> None:
    """With nothing but session errors, readings of one pose are those of a session, whatever the take is called."""
    lasting = Noise(session=noise_preset("default").session)
    one, same, other = (tracked(body, name, lasting, tpose(body.skeleton)) for name in ("monday", "monday", "tuesday"))
    own = tracked(body, "", lasting, tpose(body.skeleton))
    named = tracked(body, "calibration", lasting, tpose(body.skeleton))  # as the take itself is called
    for a, b, c, d, e in zip(one, same, other, own, named, strict=True):
        assert (a.position_m == b.position_m).all()
        assert not np.allclose(a.position_m, c.position_m, atol=1e-5)
        assert (d.position_m == e.position_m).all()


def test_what_passes_is_the_take_s_own(body: Body) -> None:
    passing = Noise(white=noise_preset("default").white)
    one, other = (tracked(body, name, passing, tpose(body.skeleton)) for name in ("monday", "tuesday"))
    assert all((a.position_m == b.position_m).all() for a, b in zip(one, other, strict=True))


def test_mount_errors_have_the_given_size(body: Body) -> None:
    off_m, turned_rad = [], []
    for session in range(60):
        worn = perturb_mounts(SIX, beside_m=0.015, turned_rad=0.2, seed=1, session=str(session))
        for nominal, real in zip(SIX, worn, strict=True):
            (at_m, turn), (real_m, real_turn) = locate_mount(body.skeleton, nominal), locate_mount(body.skeleton, real)
            off_m.append(real_m - at_m)
            turned_rad.append(rotations.log(rotations.multiply(rotations.inverse(turn), real_turn)))
    assert np.std(off_m) == pytest.approx(0.015, rel=0.08)
    assert np.std(turned_rad) == pytest.approx(0.2, rel=0.08)
    assert perturb_mounts(SIX, beside_m=0.0, turned_rad=0.0, seed=1, session="") == tuple(SIX)


def test_a_station_more_leaves_the_others_where_they_are() -> None:
    few, all_of_them = (
        perturb_mounts(mounts, beside_m=0.01, turned_rad=3.1, seed=1, session="a") for mounts in (SIX[2:], SIX)
    )
    assert few == all_of_them[2:]
