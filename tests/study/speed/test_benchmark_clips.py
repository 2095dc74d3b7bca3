"""What methods are timed on: so many frames to learn from, and takes that are not among them."""

import numpy as np
import pytest

from harness.core.seeds import generator
from harness.mocap import synthetic
from harness.reconstruct import MotionDatabase, make_method
from harness.study.speed import benchmark_clips


@pytest.fixture(scope="module")
def learnt() -> MotionDatabase:
    """Of each behaviour, one of them of the performer who is followed."""
    return MotionDatabase.build(benchmark_clips.build_common_body(), benchmark_clips.make_take_factories(8_000, 1))


def test_a_database_is_of_distinct_takes_and_of_none_that_is_held_out(learnt: MotionDatabase) -> None:
    assert len({run.take for run in learnt.segments}) == len(learnt.segments)
    assert {run.behaviour for run in learnt.segments} == set(synthetic.BEHAVIOURS)
    assert not {run.take for run in learnt.segments} & {
        take.name for take in benchmark_clips.generate_held_out_takes(10, 1, 2.0)
    }


@pytest.mark.parametrize("frames", [1, 800, 801, 802, 1_700])
def test_takes_have_exactly_so_many_frames(frames: int) -> None:
    made = [make() for make in benchmark_clips.make_take_factories(frames, 1, ("golf",))]
    assert sum(map(len, made)) == frames
    assert {take.behaviour for take in made} == {"golf"}
    assert len({take.name for take in made}) == len(made)


def test_takes_of_a_database_are_its_motion(learnt: MotionDatabase) -> None:
    again = MotionDatabase.build(benchmark_clips.build_common_body(), benchmark_clips.extract_takes(learnt)[:2])
    np.testing.assert_allclose(again.posture, learnt.posture[: len(again)], atol=1e-5)
    np.testing.assert_allclose(again.step, learnt.step[: len(again)], atol=1e-4)


def test_a_method_takes_what_it_is_given(learnt: MotionDatabase) -> None:
    learner = benchmark_clips.fit_method(
        make_method("ik"), benchmark_clips.build_common_body(), learnt, generator(1, "test")
    )
    trial = benchmark_clips.generate_held_out_clips(1, 1.0)[0]
    session = learner.begin(trial.simulation.calibration)
    found = np.array([session.step(frame).qpos for frame in trial.simulation.frames])
    assert benchmark_clips.joint_angle_error_deg(found, trial.truth) < 8.0


def test_a_take_is_seen_by_the_stations_of_the_scenario() -> None:
    takes = benchmark_clips.generate_held_out_takes(2, 1, 1.0, ("boxing",))
    (five, _), (six, _) = (
        benchmark_clips.simulate_clips(takes, 1, benchmark_clips.load_clean_scenario(name))
        for name in ("walking_five_stations", "walking")
    )
    assert five.simulation.stations == ("left_hand", "right_hand", "left_ankle", "right_ankle", "pelvis")
    assert len(six.simulation.stations) == 6
    assert len(six.truth) == len(six.simulation.frames) == pytest.approx(benchmark_clips.RATE_HZ, abs=2)
