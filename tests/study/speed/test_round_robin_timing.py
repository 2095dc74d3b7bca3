"""The benchmark of method speed: methods follow the same frames in turns, and the first second is left out."""

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.reconstruct import MotionDatabase
from harness.stream import TrackerFrame
from harness.study.speed import benchmark_clips, round_robin_timing
from harness.study.speed.benchmark_clips import WARM_UP_FRAMES, BenchmarkClip
from harness.study.speed.round_robin_timing import (
    FRAMES_PER_TURN,
    MethodTimings,
    TimedStep,
    measure_speed,
    time_method,
    time_round_robin,
)


@pytest.fixture(scope="module")
def shown() -> list[BenchmarkClip]:
    return benchmark_clips.simulate_clips(
        benchmark_clips.generate_held_out_takes(2, 1, 4.1), 1, benchmark_clips.load_clean_scenario()
    )


def test_contenders_take_turns_and_meet_every_frame_once(shown: list[BenchmarkClip]) -> None:
    met: list[tuple[str, float]] = []
    tallies = time_round_robin({name: Begin(name, met) for name in ("ours", "other")}, shown, lambda *_: None)
    turns = [met[at : at + FRAMES_PER_TURN] for at in range(0, len(met), FRAMES_PER_TURN)]
    assert all(len({name for name, _ in turn}) == 1 for turn in turns)
    assert [turn[0][0] for turn in turns] == ["ours", "other"] * (len(turns) // 2)
    times = {name: [t for who, t in met if who == name] for name in tallies}
    assert times["ours"] == times["other"]
    expected = [
        f.received_s
        for s in shown
        for f in s.simulation.frames[: len(s.simulation.frames) // FRAMES_PER_TURN * FRAMES_PER_TURN]
    ]
    assert times["ours"] == expected


def test_the_first_second_counts_for_nothing_and_the_first_frame_for_itself(shown: list[BenchmarkClip]) -> None:
    tally = time_round_robin({"ours": Begin("ours", [])}, shown, lambda *_: None)["ours"]
    turns = sum(len(s.simulation.frames) // FRAMES_PER_TURN - WARM_UP_FRAMES // FRAMES_PER_TURN for s in shown)
    assert len(tally.turn_s) == len(tally.error_deg) == turns
    assert len(tally.step_ms) == turns * FRAMES_PER_TURN
    assert tally.first_ms == pytest.approx([5_000.0] * len(shown))
    assert tally.step_ms == pytest.approx([2.0] * len(tally.step_ms))
    assert tally.fps == pytest.approx(500.0)
    assert tally.error_deg == pytest.approx([0.0] * turns)


def test_what_follows_learns_nothing_of_the_truth(shown: list[BenchmarkClip]) -> None:
    learnt = MotionDatabase.build(benchmark_clips.build_common_body(), benchmark_clips.make_take_factories(801, 1))
    follow = time_method(benchmark_clips.fit_named_method("ik", learnt, 1))
    frames = shown[0].simulation.frames[:5]
    paths = []
    for before in (shown[0].truth[0], np.zeros(55)):
        step = follow(shown[0])
        paths.append([step(frame, before)[0] for frame in frames])
    np.testing.assert_array_equal(paths[0], paths[1])


def test_methods_are_fitted_and_timed() -> None:
    database = MotionDatabase.build(
        benchmark_clips.build_common_body(), benchmark_clips.make_take_factories(900, 1, ["golf"])
    )
    clips = benchmark_clips.simulate_clips(
        benchmark_clips.generate_held_out_takes(1, 1, 3.2, ["golf"]), 1, benchmark_clips.load_clean_scenario()
    )
    blend, ik = measure_speed(("weighted_blend", "ik"), database, clips, 1)
    assert (blend.method, ik.method) == ("weighted_blend", "ik")
    assert blend.frames == ik.frames == 900
    assert blend.steps == ik.steps == 2 * FRAMES_PER_TURN
    for speed in (blend, ik):
        assert 0.0 < speed.p50_ms <= speed.p99_ms
        assert speed.fps > 1.0
        assert 0.1 < speed.error_deg < 12.0
        assert min(speed.first_ms, speed.ready_s) > 0.0
    assert ik.ratios == {"ik": 1.0}
    assert blend.ratios["ik"] > 0.0


def test_fps_is_of_all_steps_and_the_ratio_a_median_over_turns(
    shown: list[BenchmarkClip], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two of nine turns are slow: they change the mean step and not the median ratio."""
    ik = MethodTimings(turn_s=[0.1] * 9, step_ms=[2.5] * 360, error_deg=[3.0] * 9, first_ms=[4.0, 6.0])
    steps_ms = [5.0] * 280 + [50.0] * 80
    slow = MethodTimings([0.2] * 7 + [2.0] * 2, steps_ms, [1.0, 2.0] * 4 + [1.5], first_ms=[9.0, 7.0])
    monkeypatch.setattr(round_robin_timing, "time_round_robin", lambda *_: {"dynamic_map": slow, "ik": ik})
    monkeypatch.setattr(round_robin_timing, "fit_named_method", lambda *_: Idle())
    database = MotionDatabase.build(
        benchmark_clips.build_common_body(), benchmark_clips.make_take_factories(120, 1, ["golf"])
    )
    speed = measure_speed(("dynamic_map", "ik"), database, shown, 1)[0]
    assert speed.fps == pytest.approx(1e3 / np.mean(steps_ms))
    assert (speed.p50_ms, speed.p99_ms, speed.first_ms) == (5.0, 50.0, 9.0)
    assert speed.ratios == {"ik": 0.5}
    assert speed.error_deg == pytest.approx(1.5)


class Idle:
    """A method that begins and does nothing."""

    step = None

    def begin(self, calibration: object) -> "Idle":
        return self


class Begin:
    """Answers the truth, and reports that the first frame took 5 s and any other 2 ms."""

    def __init__(self, name: str, met: list[tuple[str, float]]) -> None:
        self.name, self.met = name, met

    def __call__(self, trial: BenchmarkClip) -> TimedStep:
        truth = iter(trial.truth)
        first = trial.simulation.frames[0].received_s

        def follow(frame: TrackerFrame, before: Floats) -> tuple[Floats, float]:
            self.met.append((self.name, frame.received_s))
            return next(truth), 5.0 if frame.received_s == first else 2e-3

        return follow
