"""Methods that follow the same takes in turns, a second of motion each: what else the machine does meets all alike."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from harness.core.arrays import Floats
from harness.experiment.benchmark_clips import WARM_UP_FRAMES, BenchmarkClip, joint_angle_error_deg
from harness.reconstruct.contract import Reconstructor
from harness.stream.frame import TrackerFrame

FRAMES_PER_TURN = 40
"""Frames of one contender in a row."""

ProgressCallback = Callable[[str, int, int], None]
TimedStep = Callable[[TrackerFrame, Floats], tuple[Floats, float]]
"""Takes a frame and the true pose of the one before to a configuration (55,) and the seconds that it took."""
TimedMethod = Callable[[BenchmarkClip], TimedStep]
"""Makes itself ready for a take."""


@dataclass
class MethodTimings:
    """One contender's turns."""

    turn_s: list[float] = field(default_factory=list)
    step_ms: list[float] = field(default_factory=list)
    error_deg: list[float] = field(default_factory=list)
    first_ms: list[float] = field(default_factory=list)
    """The first step of each take, which no other figure has."""

    @property
    def fps(self) -> float:
        """The median turn's."""
        return FRAMES_PER_TURN / float(np.median(self.turn_s))


def time_round_robin(
    contenders: Mapping[str, TimedMethod], shown: Sequence[BenchmarkClip], progress: ProgressCallback
) -> dict[str, MethodTimings]:
    """All contenders on all takes, in turns; the first second of a take is not counted."""
    tallies = {name: MethodTimings() for name in contenders}
    planned = sum(len(trial.simulation.frames) // FRAMES_PER_TURN for trial in shown)
    done = 0
    for trial in shown:
        followers = {name: begin(trial) for name, begin in contenders.items()}
        for start in range(0, len(trial.simulation.frames) - FRAMES_PER_TURN + 1, FRAMES_PER_TURN):
            progress(trial.take, done, planned)
            done += 1
            for name, follow in followers.items():
                turn = [
                    follow(trial.simulation.frames[t], trial.truth[max(t - 1, 0)])
                    for t in range(start, start + FRAMES_PER_TURN)
                ]
                found, seconds = np.array([qpos for qpos, _ in turn]), [spent for _, spent in turn]
                if start == 0:
                    tallies[name].first_ms.append(1e3 * seconds[0])
                if start >= WARM_UP_FRAMES:
                    tallies[name].turn_s.append(sum(seconds))
                    tallies[name].step_ms += [1e3 * spent for spent in seconds]
                    tallies[name].error_deg.append(
                        joint_angle_error_deg(found, trial.truth[start : start + FRAMES_PER_TURN])
                    )
    return tallies


def time_method(learnt: Reconstructor) -> TimedMethod:
    """A method that has learnt; only its steps are timed."""

    def begin(trial: BenchmarkClip) -> TimedStep:
        step = learnt.begin(trial.simulation.calibration).step

        def follow(frame: TrackerFrame, before: Floats) -> tuple[Floats, float]:
            start = time.perf_counter()
            qpos = step(frame).qpos
            return qpos, time.perf_counter() - start

        return follow

    return begin
