"""The motion database: independent of the room, lossless for poses, and with the provenance of every frame."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from harness.body import build_body
from harness.core.arrays import Floats
from harness.core.humanoid24 import QPOS_OF_DOF, pack
from harness.core.motion import BodyMotion
from harness.core.skeleton import equivalent_euler_angles
from harness.errors import BadInput
from harness.mocap import synthetic
from harness.reconstruct.database.frames import TakeSegment
from harness.reconstruct.database.motion_database import MotionDatabase
from harness.reconstruct.solver.ground_frame import (
    ground_from_qpos,
    posture_from_qpos,
    qpos_from_postures,
    relative_ground,
    step_ground,
)
from harness.reconstruct.solver.hinge_limits import HingeLimits
from tests.reconstruct.conftest import moved as elsewhere

BODY = build_body()


def make_take(behaviour: str, number: int, seconds: float = 2.0) -> BodyMotion:
    clip = synthetic.generate(behaviour, "p2", number, seed=1, duration_s=seconds, rate_hz=40.0)
    qpos = pack(clip.root_m, clip.world_from_root, clip.angles_rad)
    return BodyMotion(clip.name, clip.subject, clip.source, clip.behaviour, 40.0, qpos)


def changed(take: BodyMotion, qpos: Floats, name: str | None = None) -> BodyMotion:
    return BodyMotion(name or take.name, take.subject, take.source, take.behaviour, take.rate_hz, qpos)


@pytest.fixture(scope="module")
def takes() -> list[BodyMotion]:
    return [make_take("walking", 1), make_take("boxing", 1, 3.0), make_take("jumping", 2)]


@pytest.fixture(scope="module")
def database(takes: list[BodyMotion]) -> MotionDatabase:
    return MotionDatabase.build(BODY, takes)


@pytest.mark.parametrize("yaw_rad", [0.7, np.pi, -3.0])
def test_a_turned_and_shifted_room_leaves_no_trace(
    takes: list[BodyMotion], database: MotionDatabase, yaw_rad: float
) -> None:
    turned = [changed(take, elsewhere(take.qpos, yaw_rad, (5.0, -3.0, 0.0))) for take in takes]
    other = MotionDatabase.build(BODY, turned)
    np.testing.assert_allclose(other.posture, database.posture, atol=2e-6)
    np.testing.assert_allclose(other.step, database.step, atol=2e-6)
    for length in (1, 2, 3):
        windows = database.windows(length)
        np.testing.assert_allclose(other.windows(length).gather(slice(None)), windows.gather(slice(None)), atol=2e-6)
        query = np.array(takes[0].qpos[10 : 10 - length : -1])
        np.testing.assert_allclose(
            windows.query(elsewhere(query, yaw_rad, (5.0, -3.0, 0.0))), windows.query(query), atol=2e-6
        )


def test_poses_come_back(takes: list[BodyMotion], database: MotionDatabase) -> None:
    for run, take in zip(database.segments, takes, strict=True):
        back = database.qpos(slice(run.start, run.stop), ground_from_qpos(take.qpos))
        np.testing.assert_allclose(back[:, :3], take.qpos[:, :3], atol=1e-6)
        np.testing.assert_allclose(np.abs(np.vecdot(back[:, 3:7], take.qpos[:, 3:7])), 1.0, atol=1e-12)
        np.testing.assert_allclose(back[:, 7:], HingeLimits(BODY).normalise_motion(take.qpos[:, 7:]), atol=1e-6)


def test_steps_lead_through_the_take(takes: list[BodyMotion], database: MotionDatabase) -> None:
    run, take = database.segments[0], takes[0]
    ground = ground_from_qpos(take.qpos)
    at = ground[0]
    for frame in range(1, len(take)):
        at = step_ground(at, database.step[run.start + frame].astype(float))
    np.testing.assert_allclose(relative_ground(ground[-1], at), 0.0, atol=1e-5)
    np.testing.assert_array_equal(database.step[[r.start for r in database.segments]], 0.0)


def test_any_posture_but_one_upside_down_stands_again(rng: np.random.Generator) -> None:
    qpos = rng.normal(size=(500, 55))
    qpos[:, 3:7] /= np.linalg.norm(qpos[:, 3:7], axis=1, keepdims=True)
    back = qpos_from_postures(posture_from_qpos(qpos), ground_from_qpos(qpos))
    np.testing.assert_allclose(back[:, :3], qpos[:, :3], atol=1e-12)
    np.testing.assert_allclose(np.abs(np.vecdot(back[:, 3:7], qpos[:, 3:7])), 1.0, atol=1e-9)
    np.testing.assert_array_equal(posture_from_qpos(qpos)[:, 3], 0.0)
    lying = np.zeros(55)
    lying[3:7] = (
        np.sqrt(0.5),
        0.0,
        np.sqrt(0.5),
        0.0,
    )  # bent over by 90 deg: no heading of the x axis, but a ground frame
    np.testing.assert_allclose(ground_from_qpos(lying), 0.0, atol=1e-12)


@pytest.mark.parametrize("length", [1, 2, 4])
def test_a_query_is_the_window_of_its_own_poses(takes: list[BodyMotion], database: MotionDatabase, length: int) -> None:
    windows, limits = database.windows(length), HingeLimits(BODY)
    vectors = windows.gather(np.arange(len(windows)))
    assert vectors.dtype == np.float32
    for run, take in zip(database.segments, takes, strict=True):
        qpos = np.concatenate([take.qpos[:, :7], limits.normalise_motion(take.qpos[:, 7:])], axis=1)
        for frame in (length - 1, length, len(take) - 1):
            row = int(np.searchsorted(windows.frames, run.start + frame))
            assert windows.frames[row] == run.start + frame
            query = windows.query(qpos[[frame - age for age in range(length)]])
            np.testing.assert_allclose(query, vectors[row], atol=1e-6)


def test_no_window_reaches_into_another_take(database: MotionDatabase) -> None:
    for length in (1, 3):
        for with_successor in (False, True):
            windows = database.windows(length, with_successor=with_successor)
            assert len(windows) == sum(len(run) - length + 1 - with_successor for run in database.segments)
            for frame in windows.frames:
                first, last = int(frame) - length + 1, int(frame) + with_successor
                assert any(run.start <= first and last < run.stop for run in database.segments)
            ends = [run.stop - 1 - with_successor for run in database.segments]
            np.testing.assert_array_equal(windows.frames[~windows.consecutive], ends)
    with pytest.raises(BadInput, match="window of 0"):
        database.windows(0)
    assert len(database.windows(10_000)) == 0


def test_successors_are_the_frames_after(takes: list[BodyMotion], database: MotionDatabase) -> None:
    windows, take = database.windows(2, with_successor=True), takes[0]
    after = windows.successors(np.array([0, 5]))
    for row, frame in ((0, 2), (1, 7)):
        stood = qpos_from_postures(
            after[row, :52], step_ground(ground_from_qpos(take.qpos[frame - 1]), after[row, 52:].astype(float))
        )
        np.testing.assert_allclose(stood[:2], take.qpos[frame, :2], atol=1e-6)
        np.testing.assert_allclose(np.abs(stood[3:7] @ take.qpos[frame, 3:7]), 1.0, atol=1e-12)


def test_a_scale_is_the_metric_of_eq_6(database: MotionDatabase, rng: np.random.Generator) -> None:
    plain = database.windows(2)
    scale = rng.uniform(0.1, 2.0, plain.size)
    one, other = plain.gather(np.array([3, 40])).astype(float)
    mine, theirs = plain.scaled(scale).gather(np.array([3, 40])).astype(float)
    assert np.sum((mine - theirs) ** 2) == pytest.approx((one - other) @ np.diag(scale**2) @ (one - other), rel=1e-5)


def test_takes_agree_whatever_their_files_began_with(takes: list[BodyMotion], database: MotionDatabase) -> None:
    shoulder = QPOS_OF_DOF[BODY.skeleton.dof_of_bone[BODY.skeleton.index("lhumerus")]]
    wrist = 7 + QPOS_OF_DOF[BODY.skeleton.dof_names.index("lradius.rx")]
    qpos = np.array(takes[1].qpos)
    qpos[:, 7 + shoulder] = equivalent_euler_angles(qpos[:, 7 + shoulder]) - 2.0 * np.pi
    qpos[:, wrist] += 4.0 * np.pi
    other = MotionDatabase.build(BODY, [takes[0], changed(takes[1], qpos), takes[2]])
    np.testing.assert_allclose(other.posture, database.posture, atol=2e-6)


def test_every_frame_says_where_it_is_from(takes: list[BodyMotion], database: MotionDatabase) -> None:
    assert [run.take for run in database.segments] == [take.name for take in takes]
    assert [len(run) for run in database.segments] == [len(take) for take in takes]
    assert database.segments[1].behaviour == "boxing"
    assert [run.start for run in database.segments[1:]] == [run.stop for run in database.segments[:-1]]
    assert database.segments[-1].stop == len(database)


def test_a_take_or_part_of_it_can_be_left_out(takes: list[BodyMotion], database: MotionDatabase) -> None:
    name, middle = takes[1].name, database.segments[1]
    without = database.without(name)
    assert name not in {run.take for run in without.segments}
    np.testing.assert_array_equal(without.posture[: middle.start], database.posture[: middle.start])
    np.testing.assert_array_equal(without.posture[middle.start :], database.posture[middle.stop :])

    part = database.without(name, range(30, 50))
    before, after = (run for run in part.segments if run.take == name)
    assert (len(before), before.first_frame) == (30, 0)
    assert (len(after), after.first_frame) == (len(takes[1]) - 50, 50)
    np.testing.assert_array_equal(
        part.posture[after.start : after.stop], database.posture[middle.start + 50 : middle.stop]
    )
    np.testing.assert_array_equal(part.step[after.start], 0.0)
    again = part.without(name, range(45, 60)).segments[2]
    assert (again.first_frame, len(again)) == (60, len(takes[1]) - 60)
    assert part.without(name, range(30, 50)).segments == part.segments
    with pytest.raises(BadInput, match="no frames but those of"):
        MotionDatabase.build(BODY, takes[:1]).without(takes[0].name)


def test_workers_make_the_same_database_in_the_same_order(takes: list[BodyMotion], database: MotionDatabase) -> None:
    makers = [partial(make_take, "walking", 1), partial(make_take, "boxing", 1, 3.0), partial(make_take, "jumping", 2)]
    said: list[tuple[str, int, int]] = []
    other = MotionDatabase.build(BODY, makers, workers=2, progress=lambda *done: said.append(done))
    np.testing.assert_array_equal(other.posture, database.posture)
    np.testing.assert_array_equal(other.step, database.step)
    assert other.segments == database.segments
    assert said == [(take.name, done, 3) for done, take in enumerate(takes, start=1)]


def test_takes_are_read_one_at_a_time_into_a_folder(
    takes: list[BodyMotion], database: MotionDatabase, tmp_path: Path
) -> None:
    def one_by_one() -> Iterator[BodyMotion]:
        yield from takes

    other = MotionDatabase.build(BODY, one_by_one(), folder=tmp_path / "database")
    assert isinstance(other.posture, np.memmap)
    np.testing.assert_array_equal(other.posture, database.posture)
    assert other.segments == database.segments


def test_nothing_to_learn_from_and_unequal_rates_are_refused(takes: list[BodyMotion], tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="there are none"):
        MotionDatabase.build(BODY, [])
    with pytest.raises(BadInput, match="nothing has no frames"):
        MotionDatabase.build(BODY, [takes[0], changed(takes[0], takes[0].qpos[:0], "nothing")])
    slow = BodyMotion("slow", "p1", "", "", 30.0, takes[0].qpos)
    with pytest.raises(BadInput, match="slow has 30 frames a second, walking_p2_01 40"):
        MotionDatabase.build(BODY, [takes[0], slow], folder=tmp_path / "database")
    assert list(tmp_path.iterdir()) == []


def test_a_database_of_one_frame_has_no_window_of_two(takes: list[BodyMotion]) -> None:
    single = MotionDatabase.build(BODY, [changed(takes[0], takes[0].qpos[:1])])
    assert (len(single), len(single.windows(1)), len(single.windows(2))) == (1, 1, 0)
    assert single.windows(2).gather(np.zeros(0, np.int64)).shape == (0, 107)
    assert single.segments == (TakeSegment(takes[0].name, "p2", synthetic.SOURCE, "walking", 0, 1),)
