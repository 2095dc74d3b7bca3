"""Round-robin timing: methods process the same takes in turns of one second, so that other load affects all alike."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from harness.core.arrays import Floats
from harness.experiment.benchmark_clips import WARM_UP_FRAMES, BenchmarkClip, joint_angle_error_deg
from harness.reconstruct.contract import Reconstructor
from harness.stream.frame import TrackerFrame

FRAMES_PER_TURN = 40
"""Number of consecutive frames of one method."""

ProgressCallback = Callable[[str, int, int], None]
TimedStep = Callable[[TrackerFrame, Floats], tuple[Floats, float]]
"""Maps a frame and the true configuration of the previous frame to a configuration (55,) and its time [s]."""
TimedMethod = Callable[[BenchmarkClip], TimedStep]
"""Prepares a method for a clip."""


@dataclass
class MethodTimings:
    """Timings and errors of one method."""

    turn_s: list[float] = field(default_factory=list)
    step_ms: list[float] = field(default_factory=list)
    error_deg: list[float] = field(default_factory=list)
    first_ms: list[float] = field(default_factory=list)
    """Time of the first step of each take [ms], which no other field includes."""

    @property
    def fps(self) -> float:
        """Frames per second of the median turn."""
        return FRAMES_PER_TURN / float(np.median(self.turn_s))


def time_round_robin(
    methods: Mapping[str, TimedMethod], clips: Sequence[BenchmarkClip], progress: ProgressCallback
) -> dict[str, MethodTimings]:
    """Time all methods on all clips in turns; the first second of a clip is not counted."""
    timings = {name: MethodTimings() for name in methods}
    planned = sum(len(clip.simulation.frames) // FRAMES_PER_TURN for clip in clips)
    done = 0
    for clip in clips:
        steps = {name: begin(clip) for name, begin in methods.items()}
        for start in range(0, len(clip.simulation.frames) - FRAMES_PER_TURN + 1, FRAMES_PER_TURN):
            progress(clip.take, done, planned)
            done += 1
            for name, step_timed in steps.items():
                turn = [
                    step_timed(clip.simulation.frames[t], clip.truth[max(t - 1, 0)])
                    for t in range(start, start + FRAMES_PER_TURN)
                ]
                qpos, seconds = np.array([estimate for estimate, _ in turn]), [spent for _, spent in turn]
                if start == 0:
                    timings[name].first_ms.append(1e3 * seconds[0])
                if start >= WARM_UP_FRAMES:
                    timings[name].turn_s.append(sum(seconds))
                    timings[name].step_ms += [1e3 * spent for spent in seconds]
                    timings[name].error_deg.append(
                        joint_angle_error_deg(qpos, clip.truth[start : start + FRAMES_PER_TURN])
                    )
    return timings


def time_method(reconstructor: Reconstructor) -> TimedMethod:
    """A timed method from a fitted reconstructor; only its steps are timed."""

    def begin(clip: BenchmarkClip) -> TimedStep:
        step = reconstructor.begin(clip.simulation.calibration).step

        def step_timed(frame: TrackerFrame, before: Floats) -> tuple[Floats, float]:
            start = time.perf_counter()
            qpos = step(frame).qpos
            return qpos, time.perf_counter() - start

        return step_timed

    return begin
