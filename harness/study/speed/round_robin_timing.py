"""The one benchmark of method speed: methods follow the same clips in turns of one second of motion.

In turns, all methods meet the same load of the machine; ratios of speeds are medians over turns. `harness bench
methods`, `harness bench ik` and the papers' speed experiment format what is measured here.
"""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from harness.core.arrays import Floats
from harness.core.progress import ProgressCallback
from harness.reconstruct import MotionDatabase, Reconstructor
from harness.score import step_times_ms
from harness.stream import TrackerFrame
from harness.study.speed.benchmark_clips import (
    WARM_UP_FRAMES,
    BenchmarkClip,
    fit_named_method,
    joint_angle_error_deg,
)

FRAMES_PER_TURN = 40
"""Consecutive frames of one method: one second at 40 Hz."""
REFERENCE_METHOD = "ik"
"""The method that every other one is compared with, in the same turns."""

TimedStep = Callable[[TrackerFrame, Floats], tuple[Floats, float]]
"""Maps a frame and the true pose of the frame before to a configuration (55,) and the seconds that the step took."""
TimedMethod = Callable[[BenchmarkClip], TimedStep]
"""Starts a session on a clip and returns its timed step."""


@dataclass(frozen=True, eq=False)
class Turn:
    """Consecutive frames that one method followed."""

    method: str
    start: int
    """Index of the first frame in the clip."""
    qpos: Floats
    """(FRAMES_PER_TURN, 55) estimated configurations."""
    seconds: Floats
    """(FRAMES_PER_TURN,) wall time of each step [s]."""


@dataclass
class MethodTimings:
    """Times and errors of one method; the first second of every clip is left out."""

    turn_s: list[float] = field(default_factory=list)
    step_ms: list[float] = field(default_factory=list)
    error_deg: list[float] = field(default_factory=list)
    """Joint angle error (D1) of each turn [deg]."""
    first_ms: list[float] = field(default_factory=list)
    """The first step of each clip, which no other figure contains [ms]."""

    def add(self, turn: Turn) -> None:
        """Record the times of a turn."""
        if turn.start == 0:
            self.first_ms.append(1e3 * float(turn.seconds[0]))
        if turn.start >= WARM_UP_FRAMES:
            self.turn_s.append(float(turn.seconds.sum()))
            self.step_ms += (1e3 * turn.seconds).tolist()

    @property
    def fps(self) -> float:
        """Frames per second: 1 / mean step, as in the scores of a run."""
        return step_times_ms(np.array(self.step_ms))["fps"]

    @property
    def p50_ms(self) -> float:
        """Median step [ms]."""
        return step_times_ms(np.array(self.step_ms))["step_p50_ms"]

    @property
    def p99_ms(self) -> float:
        """99th percentile of the steps [ms]."""
        return step_times_ms(np.array(self.step_ms))["step_p99_ms"]

    def speed_ratio(self, other: "MethodTimings") -> float:
        """How many times as fast this method is as the other: the median over turns."""
        return float(np.median(np.array(other.turn_s) / np.array(self.turn_s)))


@dataclass(frozen=True)
class MethodSpeed:
    """Speed and error of one method with one database."""

    method: str
    frames: int
    """Frames of the database."""
    steps: int
    """Number of timed steps."""
    fps: float
    """Frames per second: 1 / mean step."""
    p50_ms: float
    """Median step [ms]."""
    p99_ms: float
    """99th percentile of the steps [ms]."""
    first_ms: float
    """The slowest first step of a clip [ms]."""
    ready_s: float
    """Time to fit the method and to begin a session [s]."""
    ratios: Mapping[str, float]
    """Reference -> how many times as fast as it the method is, median over turns."""
    error_deg: float
    """Mean joint angle error (D1) [deg]."""


def measure_speed(
    methods: Sequence[str],
    database: MotionDatabase,
    clips: Sequence[BenchmarkClip],
    seed: int,
    *,
    references: Mapping[str, TimedMethod] | None = None,
    progress: ProgressCallback = lambda clip, done, planned: None,
) -> list[MethodSpeed]:
    """Fit methods to a database and measure their speed on held-out clips, in turns.

    `ik` must be among the methods: every speed is also given relative to it, and to further `references`, which take
    turns with the methods.
    """
    ready_s, contenders = dict[str, float](), dict(references or {})
    for name in methods:
        start = time.perf_counter()
        reconstructor = fit_named_method(name, database, seed)
        reconstructor.begin(clips[0].simulation.calibration)
        ready_s[name], contenders[name] = time.perf_counter() - start, time_method(reconstructor)
    timings = time_round_robin(contenders, clips, progress)
    compared = (REFERENCE_METHOD, *(references or ()))
    return [
        MethodSpeed(
            method=name,
            frames=len(database),
            steps=len(timings[name].step_ms),
            fps=timings[name].fps,
            p50_ms=timings[name].p50_ms,
            p99_ms=timings[name].p99_ms,
            first_ms=max(timings[name].first_ms),
            ready_s=ready_s[name],
            ratios={other: timings[name].speed_ratio(timings[other]) for other in compared},
            error_deg=float(np.mean(timings[name].error_deg)),
        )
        for name in methods
    ]


def time_round_robin(
    contenders: Mapping[str, TimedMethod], clips: Sequence[BenchmarkClip], progress: ProgressCallback
) -> dict[str, MethodTimings]:
    """Time all contenders on all clips, in turns."""
    timings = {name: MethodTimings() for name in contenders}
    planned = sum(len(clip.simulation.frames) // FRAMES_PER_TURN for clip in clips) * len(contenders)
    done = 0
    for clip in clips:
        steps = {name: begin(clip) for name, begin in contenders.items()}
        for turn in take_turns(steps, clip.simulation.frames, clip.truth):
            progress(clip.take, done, planned)
            done += 1
            timings[turn.method].add(turn)
            if turn.start >= WARM_UP_FRAMES:
                truth = clip.truth[turn.start : turn.start + FRAMES_PER_TURN]
                timings[turn.method].error_deg.append(joint_angle_error_deg(turn.qpos, truth))
    return timings


def take_turns(steps: Mapping[str, TimedStep], frames: Sequence[TrackerFrame], truth: Floats) -> Iterator[Turn]:
    """Yield the turns of all methods on one clip; frames after the last full turn are left out.

    `truth` (T, 55) is the pose at each frame. A step receives that of the frame before, of the first frame its own.
    """
    for start in range(0, len(frames) - FRAMES_PER_TURN + 1, FRAMES_PER_TURN):
        for name, step in steps.items():
            results = [step(frames[t], truth[max(t - 1, 0)]) for t in range(start, start + FRAMES_PER_TURN)]
            yield Turn(name, start, np.array([qpos for qpos, _ in results]), np.array([s for _, s in results]))


def time_method(reconstructor: Reconstructor) -> TimedMethod:
    """Wrap a fitted method so that its steps, and nothing else, are timed."""

    def begin(clip: BenchmarkClip) -> TimedStep:
        step = reconstructor.begin(clip.simulation.calibration).step

        def timed_step(frame: TrackerFrame, previous_truth: Floats) -> tuple[Floats, float]:
            start = time.perf_counter()
            qpos = step(frame).qpos
            return qpos, time.perf_counter() - start

        return timed_step

    return begin
