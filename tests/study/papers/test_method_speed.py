"""Paces are told by the steps that were timed."""

import numpy as np
import pytest

from harness.experiment import benchmark_clips
from harness.experiment.round_robin_timing import MethodTimings
from harness.reconstruct.database import MotionDatabase
from harness.study.papers import method_speed
from harness.study.papers.speed_dataset import SpeedDataset


def test_methods_are_timed_on_what_was_gathered() -> None:
    learnt = MotionDatabase.build(
        benchmark_clips.build_common_body(), benchmark_clips.make_take_factories(900, 1, ["golf"])
    )
    shown = benchmark_clips.simulate_clips(
        benchmark_clips.generate_held_out_takes(1, 1, 3.2, ["golf"]), 1, benchmark_clips.load_clean_scenario()
    )
    blend, ik = method_speed.measure_speed(("weighted_blend", "ik"), SpeedDataset(learnt, shown), 1)
    assert (blend.method, ik.method) == ("weighted_blend", "ik")
    assert blend.frames == ik.frames == 900
    assert blend.steps == ik.steps == 2 * 40
    for found in (blend, ik):
        assert 0.0 < found.p50_ms <= found.p99_ms
        assert found.fps > 1.0
        assert 0.1 < found.error_deg < 12.0
        assert min(found.first_ms, found.ready_s) > 0.0
    assert ik.to_ik == 1.0
    assert blend.to_ik > 0.0


def test_a_pace_is_of_all_steps_and_the_ratio_of_single_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two slow turns among nine: the mean has them, the median ratio has not."""
    ik = MethodTimings(turn_s=[0.1] * 9, step_ms=[2.5] * 360, error_deg=[3.0] * 9, first_ms=[4.0, 6.0])
    own = MethodTimings(
        turn_s=[0.2] * 7 + [2.0] * 2, step_ms=[5.0] * 280 + [50.0] * 80, error_deg=[1.0, 2.0] * 4 + [1.5]
    )
    own.first_ms = [9.0, 7.0]
    monkeypatch.setattr(method_speed, "time_round_robin", lambda *_: {"dynamic_map": own, "ik": ik})
    learnt = MotionDatabase.build(
        benchmark_clips.build_common_body(), benchmark_clips.make_take_factories(120, 1, ["golf"])
    )
    shown = benchmark_clips.simulate_clips(
        benchmark_clips.generate_held_out_takes(1, 1, 1.0, ["golf"]), 1, benchmark_clips.load_clean_scenario()
    )
    monkeypatch.setattr(benchmark_clips, "fit_named_method", lambda *_: _Idle())
    found = method_speed.measure_speed(("dynamic_map", "ik"), SpeedDataset(learnt, shown), 1)[0]
    assert found.fps == pytest.approx(1e3 / np.mean([5.0] * 280 + [50.0] * 80))
    assert (found.p50_ms, found.p99_ms, found.first_ms) == (5.0, 50.0, 9.0)
    assert found.to_ik == 0.5
    assert found.error_deg == pytest.approx(1.5)


def test_the_machine_has_a_name() -> None:
    assert method_speed.processor_name().strip()


class _Idle:
    def begin(self, worn: object) -> object:
        return self
