"""Takes that trackers observed: their frames, and the true poses of the motion behind them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import Floats, Ints, freeze
from harness.core.calibration import Calibration
from harness.core.motion import BodyMotion
from harness.experiment.clip_evaluation import ClipEvaluation
from harness.score import COVERAGE_FLOOR, LoopFrames, PoseSequence, compute_poses
from harness.simulate import Trajectory, sampling_times_s
from harness.stream import TrackerFrame, make_inputs, split_frames


@dataclass(frozen=True, eq=False)
class ObservedTake:
    """F frames of S stations, and the E true poses of the motion that they observed."""

    clip: ClipEvaluation
    """The performer's body, and what methods learn from."""
    motion: BodyMotion
    """The true motion on that body."""
    frames: tuple[TrackerFrame, ...]
    """The frames that methods receive."""
    calibration: Calibration
    """The calibration of these stations that methods receive."""
    loops: tuple[LoopFrames, ...]
    """Which frames have a truth, and which true frame is theirs; one loop or more."""
    sample_s: Floats
    """(E, S) time in the motion at which each station is sampled for each true frame [s]."""
    rate_hz: float
    overload: bool = True
    """Whether errors count although the line lost more than half of the records."""
    notes: tuple[str, ...] = ()
    """How the frames were related to the motion, where their clock does not tell."""

    def __post_init__(self) -> None:
        freeze(self, sample_s=("E", len(self.calibration.stations)))

    @cached_property
    def truth_qpos(self) -> Floats:
        """(E, 55) true configurations, at the mean time of the stations."""
        return Trajectory(self.clip.body, self.motion).qpos(self.sample_s.mean(axis=1))

    @cached_property
    def truth(self) -> PoseSequence:
        """The true poses."""
        return compute_poses(self.clip.body.skeleton, self.truth_qpos)

    @property
    def truth_row(self) -> Ints:
        """(F,) row of the true pose of each frame; -1 where there is none."""
        out = np.full(len(self.frames), -1)
        for loop in self.loops:
            out[loop.rows] = loop.index
        return out

    @cached_property
    def records_arrived(self) -> int:
        """Number of records in the frames that have a truth."""
        frames = (self.frames[row] for loop in self.loops for row in loop.rows)
        return sum(int((np.isfinite(f.measured_s) | f.position_valid | f.orientation_valid).sum()) for f in frames)

    @property
    def records_expected(self) -> int:
        """Number of records of all stations in the frames that are expected."""
        return len(self.calibration.stations) * sum(len(loop.expected) for loop in self.loops)

    @property
    def has_records(self) -> bool:
        """Whether enough records arrived for errors to count."""
        return self.overload or self.records_arrived >= COVERAGE_FLOOR * self.records_expected

    @cached_property
    def _columns(self) -> list[NDArray[Any]]:
        """The fields of all frames (F, S, ...)."""
        return [np.array([getattr(frame, name) for frame in self.frames]) for name in TrackerFrame.__slots__]

    def copy_frames(self, stations: Sequence[str]) -> list[TrackerFrame]:
        """New frames of these stations, in memory that nobody else sees."""
        rows = [self.calibration.stations.index(name) for name in stations]
        received_s, *arrays = self._columns
        return split_frames(received_s.tolist(), *(array[:, rows] for array in arrays))


def simulated_take(clip: ClipEvaluation, inputs: str) -> ObservedTake:
    """The simulation of a clip as methods with these inputs receive it; all of its true frames are expected."""
    simulation, calibration, motion = clip.simulation, clip.performer_calibration, clip.subject.take
    mask = make_inputs(inputs, simulation.stations).mask
    rows = np.flatnonzero(simulation.frame_index >= 0)
    return ObservedTake(
        clip,
        motion,
        tuple(map(mask, calibration.map_stream(simulation).frames)),
        calibration.calibration,
        (LoopFrames(rows, simulation.frame_index[rows], range(simulation.expected)),),
        sampling_times_s(motion.duration_s, clip.session.tracker, len(simulation.stations)),
        clip.session.tracker.rate_hz,
        overload=clip.session.tracker.overload,
    )
