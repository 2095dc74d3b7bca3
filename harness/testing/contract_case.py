"""The test case of the contract suite: a method, a swaying motion that is not among its examples, disturbed frames.

Sessions that are compared are begun together from one reconstructor, unless their order is what is tested. So a fault
violates one rule and no other. The assertions that the rules share raise `RuleViolation`.
"""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from harness.body import Body, build_body
from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate, Origin, Status, answer_lag
from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.reconstruct import Method, Reconstructor, Session
from harness.stream import TrackerFrame
from harness.testing.frames import drop_stations, exact_calibration, exact_frames, swaying_motion

RATE_HZ, FRAMES = 40.0, 60
FRAMES_PER_SECOND = round(RATE_HZ)
LONG_FRAMES, DISTURBED_FRAMES = 7 * FRAMES_PER_SECOND // 2, range(FRAMES_PER_SECOND, 2 * FRAMES_PER_SECOND)
"""Number of frames of the long take, and the range of them that is disturbed."""
Frames = Sequence[TrackerFrame]


@dataclass(frozen=True, eq=False)
class ContractCase:
    """A method, examples for it, and a take that is not among them; each `fit` starts anew."""

    method: Method
    body: Body
    calibration: Calibration
    truth: Floats
    """(LONG_FRAMES, 55) true configurations."""

    def examples(self) -> list[BodyMotion]:
        """New examples at every call; [] for a method that needs none."""
        if not self.method.needs_examples:
            return []
        return [
            BodyMotion(f"sway_{n}", "nobody", "swaying", "", RATE_HZ, swaying_motion(self.body, 160, n))
            for n in (2, 3, 4)
        ]

    def fit(self) -> Reconstructor:
        """Fit the method anew, with `generator(1, "fit")`."""
        return self.method.fit(self.body, self.examples(), generator(1, "fit"))

    @cached_property
    def reconstructor(self) -> Reconstructor:
        """A fitted method, shared by the rules that look at single sessions."""
        return self.fit()

    @cached_property
    def long_frames(self) -> Frames:
        """Exact readings of the whole motion."""
        return exact_frames(self.body, self.calibration, self.truth, RATE_HZ)

    @property
    def frames(self) -> Frames:
        """The first FRAMES of them."""
        return self.long_frames[:FRAMES]

    @cached_property
    def bounds(self) -> Floats:
        """(2, 3) lower and upper corner of a box 3 m around the motion [m]."""
        root_m = self.truth[:, :3]
        return np.array([root_m.min(axis=0) - 3.0, root_m.max(axis=0) + 3.0])

    def run(self, frames: Frames) -> list[Estimate]:
        """Estimates of a new session, one for each frame that it answers: all but the last if a method waits."""
        return answers_by_frame(self.steps(frames))

    def steps(self, frames: Frames) -> list[Estimate]:
        """Estimates of a new session, one for each step."""
        return run_session(self.reconstructor.begin(self.calibration), frames)

    def begin_sessions(self, count: int) -> list[Session]:
        """Begin `count` sessions of one newly fitted reconstructor."""
        reconstructor = self.fit()
        return [reconstructor.begin(self.calibration) for _ in range(count)]


def make_case(method: Method) -> ContractCase:
    body = build_body()
    return ContractCase(method, body, exact_calibration(body), swaying_motion(body, LONG_FRAMES))


def run_session(session: Session, frames: Frames) -> list[Estimate]:
    return [session.step(frame) for frame in frames]


def answers_by_frame(estimates: Sequence[Estimate]) -> list[Estimate]:
    """The last estimate of each frame that is answered, from those of all steps of a session."""
    return list(estimates[answer_lag(estimates[-1]) :])


def stack_qpos(estimates: Sequence[Estimate]) -> Floats:
    """Stack the current configurations of estimates: (F, 55)."""
    return np.array([estimate.qpos for estimate in estimates])


def hash_motions(takes: Sequence[BodyMotion]) -> str:
    digest = hashlib.blake2b()
    for take in takes:
        digest.update(repr((take.name, take.subject, take.source, take.behaviour, take.rate_hz)).encode())
        digest.update(np.ascontiguousarray(take.qpos).tobytes())
    return digest.hexdigest()


def transform_motion(qpos: Floats, yaw_rad: float, shift_m: Floats) -> Floats:
    """Turn a motion (T, 55) about the vertical through the origin, then shift it."""
    turn, out = rotations.about_z(yaw_rad), np.array(qpos)
    out[:, :3] = rotations.rotate(turn, qpos[:, :3]) + shift_m
    out[:, 3:7] = rotations.multiply(turn, qpos[:, 3:7])
    return out


def keep_positions(frame: TrackerFrame) -> TrackerFrame:
    missing = np.full_like(frame.tracker_from_station, np.nan)
    return replace(frame, orientation_valid=np.zeros(len(missing), bool), tracker_from_station=missing)


def keep_orientations(frame: TrackerFrame) -> TrackerFrame:
    missing_m = np.full_like(frame.position_m, np.nan)
    return replace(frame, position_valid=np.zeros(len(missing_m), bool), position_m=missing_m)


def offset_positions(frame: TrackerFrame, offset_m: Floats) -> TrackerFrame:
    """Add an offset (S, 3) or (3,) along the tracker's axes to the positions."""
    return replace(frame, position_m=frame.position_m + offset_m)


def rotate_orientations(frame: TrackerFrame, angle_rad: float) -> TrackerFrame:
    """Turn every orientation about the vertical; positions are unchanged."""
    turn = rotations.about_z(angle_rad)
    return replace(frame, tracker_from_station=rotations.multiply(turn, frame.tracker_from_station))


def _offset_first_station(frame: TrackerFrame) -> TrackerFrame:
    offset_m = np.zeros((len(frame.quality), 3))
    offset_m[0, 0] = 0.3
    return offset_positions(frame, offset_m)


DISTURBANCES: dict[str, tuple[range, Callable[[TrackerFrame], TrackerFrame]]] = {
    "one station lost": (DISTURBED_FRAMES, lambda frame: drop_stations(frame, [0])),
    "all stations lost": (DISTURBED_FRAMES, lambda frame: drop_stations(frame, range(len(frame.quality)))),
    "one station off by 0.3 m": (DISTURBED_FRAMES, _offset_first_station),
    "all stations turned by 30 deg": (DISTURBED_FRAMES, lambda frame: rotate_orientations(frame, np.pi / 6.0)),
    "all stations off by 1 m at the start": (
        range(FRAMES_PER_SECOND),
        lambda frame: offset_positions(frame, np.array([1.0, 0.0, 0.0])),
    ),
}
"""Name -> disturbed frames (1 s) and the disturbance, as in `simulate.disturbance`."""


def disturb_frames(frames: Frames, disturbance: str) -> tuple[list[TrackerFrame], slice]:
    """Apply a disturbance; also returns the frames in which recovery is measured: 1 to 1.5 s after its end."""
    disturbed, apply = DISTURBANCES[disturbance]
    window = slice(disturbed.stop + FRAMES_PER_SECOND, disturbed.stop + 3 * FRAMES_PER_SECOND // 2)
    return [apply(frame) if i in disturbed else frame for i, frame in enumerate(frames[: window.stop])], window


class RuleViolation(Exception):
    """A rule does not hold; the message describes the fault."""


def require_poses(case: ContractCase, frames: Frames) -> str:
    """Require valid poses of a new session; returns the number of frames as text."""
    for index, estimate in enumerate(case.steps(frames)):
        require_pose(case, index, estimate)
    return f"{len(frames)} frames"


def require_pose(case: ContractCase, index: int, estimate: Estimate) -> None:
    """Require a finite configuration (55,) with a unit root quaternion near the stations, a status and an origin."""
    qpos = np.asarray(estimate.qpos)
    if qpos.shape != (55,) or not np.all(np.isfinite(qpos)):
        count = np.count_nonzero(~np.isfinite(qpos))
        raise RuleViolation(f"qpos in frame {index} has shape {qpos.shape} and {count} non-finite numbers")
    if abs(float(np.linalg.norm(qpos[3:7])) - 1.0) > 1e-6:
        raise RuleViolation(f"the root quaternion in frame {index} has length {np.linalg.norm(qpos[3:7]):.6f}")
    if np.any(qpos[:3] < case.bounds[0]) or np.any(qpos[:3] > case.bounds[1]):
        raise RuleViolation(f"the root in frame {index} is at {np.round(qpos[:3], 2)}, far from every station")
    if not isinstance(estimate.status, Status):
        raise RuleViolation(f"the status in frame {index} is {estimate.status!r}, not a Status")
    if not isinstance(estimate.origin, Origin):
        raise RuleViolation(f"the origin in frame {index} is {estimate.origin!r}, not an Origin")


def require_identical(qpos: Floats, expected_qpos: Floats, verb: str = "differ") -> str:
    """Require two sets of estimates (F, 55) to be identical to the bit; `verb` describes the fault."""
    differing = np.flatnonzero(np.any(qpos != expected_qpos, axis=1))
    if len(differing):
        most = float(np.max(np.abs(qpos - expected_qpos)))
        raise RuleViolation(
            f"{len(differing)} estimates {verb}, the first in frame {differing[0]}, by up to {most:.3g}"
        )
    return f"{len(qpos)} estimates are identical to the bit"
