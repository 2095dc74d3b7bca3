"""Frames through shared memory: all of them in order, or the newest ones for a slow reader."""

from dataclasses import replace
from multiprocessing import get_context

import numpy as np

from harness.body import Kinematics, build_body
from harness.live.shared_memory import PoseRing
from tests.live.posing import configuration, live_pose

KINEMATICS = Kinematics(build_body())


def test_a_frame_comes_back_as_it_was(rng: np.random.Generator) -> None:
    ring, qpos = PoseRing(get_context("spawn"), 2), configuration(rng)
    count, records = ring.read(0)
    assert (count, len(records)) == (0, 0)
    pose = live_pose(qpos, 7, 2.5, KINEMATICS)
    pose = replace(pose, frame=replace(pose.frame, suspect=np.array([True, False])))
    ring.put(pose)
    count, records = ring.read(0)
    assert count == 1
    np.testing.assert_array_equal(records[0, :4], [7, 2.5, 0.0, 0])
    np.testing.assert_array_equal(PoseRing.qpos(records)[0], qpos)
    stations = ring.station_columns(records)[0]
    np.testing.assert_array_equal(stations[:, 3:7], pose.frame.tracker_from_station)
    np.testing.assert_array_equal(stations[:, 7:10], np.ones((2, 3)))
    assert PoseRing.room(records[0]) is None
    back = PoseRing.frame(records[0, :4], stations)
    np.testing.assert_array_equal(back.suspect, pose.frame.suspect)


def test_the_room_of_a_frame_comes_with_it(rng: np.random.Generator) -> None:
    ring = PoseRing(get_context("spawn"), 2)
    room = np.array([1.0, 2.0, 2.5]), np.array([0.0, 1.0, 0.0, 0.0])
    ring.put(replace(live_pose(configuration(rng), kinematics=KINEMATICS), room=room))
    back = PoseRing.room(ring.read(0)[1][0])
    assert back is not None
    np.testing.assert_array_equal(np.concatenate(back), np.concatenate(room))


def test_the_stated_standard_deviations_of_a_frame_come_with_it(rng: np.random.Generator) -> None:
    ring, sigma_rad = PoseRing(get_context("spawn"), 2), rng.uniform(0.01, 0.2, 48)
    pose = live_pose(configuration(rng), kinematics=KINEMATICS)
    ring.put(replace(pose, estimate=replace(pose.estimate, angle_sigma_rad=sigma_rad)))
    ring.put(pose)
    stated, none = ring.read(0)[1]
    np.testing.assert_array_equal(PoseRing.sigma(stated), sigma_rad)
    assert PoseRing.sigma(none) is None


def test_a_reader_gets_every_frame_once(rng: np.random.Generator) -> None:
    ring, qpos, seen, numbers = PoseRing(get_context("spawn"), 2), configuration(rng), 0, []
    for number in range(3000):
        ring.put(live_pose(qpos, number, kinematics=KINEMATICS))
        if number % 700 == 699 or number == 2999:
            seen, records = ring.read(seen)
            numbers += records[:, 0].astype(int).tolist()
    assert numbers == list(range(3000))


def test_a_slow_reader_gets_the_newest_frames(rng: np.random.Generator) -> None:
    ring, qpos = PoseRing(get_context("spawn"), 2), configuration(rng)
    for number in range(2500):
        ring.put(live_pose(qpos, number, kinematics=KINEMATICS))
    count, records = ring.read(0)
    assert count == 2500
    np.testing.assert_array_equal(records[:, 0], np.arange(2500 - 1023, 2500))
