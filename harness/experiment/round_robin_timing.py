"""Methods that follow the same takes in turns, a second of motion each: what else the machine does meets all alike."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from harness.core.arrays import Floats
from harness.experiment.benchmark_clips import WARM_UP, Trial, error_deg
from harness.reconstruct.contract import Reconstructor
from harness.stream.frame import TrackerFrame

TURN = 40
"""Frames of one contender in a row."""

Progress = Callable[[str, int, int], None]
Follower = Callable[[TrackerFrame, Floats], tuple[Floats, float]]
"""Takes a frame and the true pose of the one before to a configuration (55,) and the seconds that it took."""
Contender = Callable[[Trial], Follower]
"""Makes itself ready for a take."""


@dataclass
class Tally:
    """One contender's turns."""

    turn_s: list[float] = field(default_factory=list)
    step_ms: list[float] = field(default_factory=list)
    error_deg: list[float] = field(default_factory=list)
    first_ms: list[float] = field(default_factory=list)
    """The first step of each take, which no other figure has."""

    @property
    def fps(self) -> float:
        """The median turn's."""
        return TURN / float(np.median(self.turn_s))


def contest(contenders: Mapping[str, Contender], shown: Sequence[Trial], progress: Progress) -> dict[str, Tally]:
    """All contenders on all takes, in turns; the first second of a take is not counted."""
    tallies = {name: Tally() for name in contenders}
    planned = sum(len(trial.simulation.frames) // TURN for trial in shown)
    done = 0
    for trial in shown:
        followers = {name: begin(trial) for name, begin in contenders.items()}
        for start in range(0, len(trial.simulation.frames) - TURN + 1, TURN):
            progress(trial.take, done, planned)
            done += 1
            for name, follow in followers.items():
                turn = [
                    follow(trial.simulation.frames[t], trial.truth[max(t - 1, 0)]) for t in range(start, start + TURN)
                ]
                found, seconds = np.array([qpos for qpos, _ in turn]), [spent for _, spent in turn]
                if start == 0:
                    tallies[name].first_ms.append(1e3 * seconds[0])
                if start >= WARM_UP:
                    tallies[name].turn_s.append(sum(seconds))
                    tallies[name].step_ms += [1e3 * spent for spent in seconds]
                    tallies[name].error_deg.append(error_deg(found, trial.truth[start : start + TURN]))
    return tallies


def following(learnt: Reconstructor) -> Contender:
    """A method that has learnt; only its steps are timed."""

    def begin(trial: Trial) -> Follower:
        step = learnt.begin(trial.simulation.calibration).step

        def follow(frame: TrackerFrame, before: Floats) -> tuple[Floats, float]:
            start = time.perf_counter()
            qpos = step(frame).qpos
            return qpos, time.perf_counter() - start

        return follow

    return begin
