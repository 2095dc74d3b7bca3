"""What the contract suite puts a method through: a swaying performer whom it has not seen, and disturbed frames.

Sessions that are compared are begun together, of one reconstructor, unless their order is what is judged: so each
rule sees its own fault and no other's.
"""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from harness.body import humanoid
from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.reconstruct.contract import Method, Reconstructor, Session
from harness.stream.frame import TrackerFrame
from harness.testing.frames import drop_stations, exact_calibration, exact_frames, swaying_motion

RATE_HZ, FRAMES = 40.0, 60
FRAMES_PER_SECOND = round(RATE_HZ)
LONG_FRAMES, DISTURBED_FRAMES = 7 * FRAMES_PER_SECOND // 2, range(FRAMES_PER_SECOND, 2 * FRAMES_PER_SECOND)
"""Frames of a long take, and those of it that are disturbed."""
Frames = Sequence[TrackerFrame]


@dataclass(frozen=True, eq=False)
class ContractCase:
    """A method, examples for it, and a take that is none of them; each `fitted` learns anew."""

    method: Method
    body: Body
    calibration: Calibration
    truth: Floats
    """(LONG, 55) configurations."""

    def examples(self) -> list[BodyMotion]:
        """New ones every time, for methods that learn."""
        if not self.method.needs_examples:
            return []
        return [
            BodyMotion(f"sway_{n}", "nobody", "swaying", "", RATE_HZ, swaying_motion(self.body, 160, n))
            for n in (2, 3, 4)
        ]

    def fit(self) -> Reconstructor:
        """`generator(1, "fit")` is its chance."""
        return self.method.fit(self.body, self.examples(), generator(1, "fit"))

    @cached_property
    def reconstructor(self) -> Reconstructor:
        """One for all rules that look at single sessions."""
        return self.fit()

    @cached_property
    def long_frames(self) -> Frames:
        return exact_frames(self.body, self.calibration, self.truth, RATE_HZ)

    @property
    def frames(self) -> Frames:
        return self.long_frames[:FRAMES]

    @cached_property
    def bounds(self) -> Floats:
        """(2, 3) a box around the whole motion [m]."""
        root_m = self.truth[:, :3]
        return np.array([root_m.min(axis=0) - 3.0, root_m.max(axis=0) + 3.0])

    def run(self, frames: Frames) -> list[Estimate]:
        """Answers of a new session."""
        return run_session(self.reconstructor.begin(self.calibration), frames)

    def begin_sessions(self, count: int) -> list[Session]:
        """So many sessions of one new reconstructor."""
        reconstructor = self.fit()
        return [reconstructor.begin(self.calibration) for _ in range(count)]


def make_case(method: Method) -> ContractCase:
    body = humanoid.build_body()
    return ContractCase(method, body, exact_calibration(body), swaying_motion(body, LONG_FRAMES))


def run_session(session: Session, frames: Frames) -> list[Estimate]:
    return [session.step(frame) for frame in frames]


def stack_qpos(estimates: Sequence[Estimate]) -> Floats:
    """(F, 55) as they are now."""
    return np.array([estimate.qpos for estimate in estimates])


def hash_motions(takes: Sequence[BodyMotion]) -> str:
    whole = hashlib.blake2b()
    for take in takes:
        whole.update(repr((take.name, take.subject, take.source, take.behaviour, take.rate_hz)).encode())
        whole.update(np.ascontiguousarray(take.qpos).tobytes())
    return whole.hexdigest()


def transform_motion(qpos: Floats, yaw_rad: float, by_m: Floats) -> Floats:
    """The same motion (T, 55) turned about the vertical through the origin, then shifted."""
    turn, out = rotations.about_z(yaw_rad), np.array(qpos)
    out[:, :3] = rotations.rotate(turn, qpos[:, :3]) + by_m
    out[:, 3:7] = rotations.multiply(turn, qpos[:, 3:7])
    return out


def keep_positions(frame: TrackerFrame) -> TrackerFrame:
    nothing = np.full_like(frame.tracker_from_station, np.nan)
    return replace(frame, orientation_valid=np.zeros(len(nothing), bool), tracker_from_station=nothing)


def keep_orientations(frame: TrackerFrame) -> TrackerFrame:
    nothing_m = np.full_like(frame.position_m, np.nan)
    return replace(frame, position_valid=np.zeros(len(nothing_m), bool), position_m=nothing_m)


def offset_positions(frame: TrackerFrame, offset_m: Floats) -> TrackerFrame:
    """Positions off by (S, 3) or (3,) along the tracker's axes."""
    return replace(frame, position_m=frame.position_m + offset_m)


def rotate_orientations(frame: TrackerFrame, angle_rad: float) -> TrackerFrame:
    """Every orientation off by so much about the vertical, positions as they are."""
    turn = rotations.about_z(angle_rad)
    return replace(frame, tracker_from_station=rotations.multiply(turn, frame.tracker_from_station))


def _offset_first_station(frame: TrackerFrame) -> TrackerFrame:
    offset_m = np.zeros((len(frame.quality), 3))
    offset_m[0, 0] = 0.3
    return offset_positions(frame, offset_m)


DISTURBANCES: dict[str, tuple[range, Callable[[TrackerFrame], TrackerFrame]]] = {
    "one station lost": (DISTURBED_FRAMES, lambda frame: drop_stations(frame, [0])),
    "all lost": (DISTURBED_FRAMES, lambda frame: drop_stations(frame, range(len(frame.quality)))),
    "one 0.3 m off": (DISTURBED_FRAMES, _offset_first_station),
    "all turned by 30 deg": (DISTURBED_FRAMES, lambda frame: rotate_orientations(frame, np.pi / 6.0)),
    "a start 1 m off": (range(FRAMES_PER_SECOND), lambda frame: offset_positions(frame, np.array([1.0, 0.0, 0.0]))),
}
"""What goes wrong in which frames, and how: what `simulate.disturbance` does, for 1 s each."""


def disturb_frames(frames: Frames, what: str) -> tuple[list[TrackerFrame], slice]:
    """Frames with something gone wrong, and which of them recovery is judged by: half a second from 1 s after it."""
    when, spoil = DISTURBANCES[what]
    judged = slice(when.stop + FRAMES_PER_SECOND, when.stop + 3 * FRAMES_PER_SECOND // 2)
    return [spoil(frame) if index in when else frame for index, frame in enumerate(frames[: judged.stop])], judged
