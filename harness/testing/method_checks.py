"""What every reconstructor must do, to run on your own: `check_method(MyMethod())`.

Each check raises `MethodBroken`, which names the rule and what was seen. They judge conduct, not accuracy: a method
that always answers with the T-pose passes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.body import humanoid
from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate, Status
from harness.core.motion import Take
from harness.core.seeds import generator
from harness.errors import HarnessError
from harness.reconstruct.contract import Method, Reconstructor
from harness.stream.frame import TrackerFrame
from harness.testing.frames import exact_frames, swaying, without, worn

FRAMES, RATE_HZ = 60, 40.0


class MethodBroken(HarnessError):
    """A rule of the contract that a method does not keep."""

    def __init__(self, method: str, rule: str, seen: str) -> None:
        super().__init__(method, rule, seen)
        self.method, self.rule, self.seen = self.args

    def __str__(self) -> str:
        return f"{self.method} breaks the rule that {self.rule}: {self.seen}."


@dataclass(frozen=True, eq=False)
class Trial:
    """A method fitted to swaying takes, and a swaying performer whom it has not seen."""

    method: Method
    reconstructor: Reconstructor
    calibration: Calibration
    frames: Sequence[TrackerFrame]
    bounds: Floats
    """(2, 3) a box around the whole motion [m]."""


def check_method(method: Method) -> None:
    """Every check; MethodBroken at the first rule that does not hold."""
    trial = make_trial(method)
    for check in CHECKS:
        check(trial)


def make_trial(method: Method) -> Trial:
    """Fits the method; `generator(1, "fit")` is its chance."""
    body = humanoid.build()
    examples = [Take(f"sway_{n}", "nobody", "swaying", "", RATE_HZ, swaying(body, 80, n)) for n in (2, 3)]
    qpos = swaying(body, FRAMES)
    calibration = worn(body)
    reconstructor = method.fit(body, examples if method.needs_examples else [], generator(1, "fit"))
    bounds = np.array([qpos[:, :3].min(axis=0) - 3.0, qpos[:, :3].max(axis=0) + 3.0])
    return Trial(method, reconstructor, calibration, exact_frames(body, calibration, qpos, RATE_HZ), bounds)


def answers_are_poses(trial: Trial) -> None:
    """Finite numbers, a unit quaternion, a place in the room, a status, on plain frames and on poor ones."""
    for frames in (trial.frames, _poor(trial.frames)):
        for index, estimate in enumerate(_run(trial, frames)):
            _require_pose(trial, index, estimate)


def is_deterministic(trial: Trial) -> None:
    """The same examples and frames give the same answers."""
    once, again = (_qpos(_run(make_trial(trial.method))) for _ in range(2))
    _require_same(trial, "equal input gives equal answers", once, again)


def begins_anew(trial: Trial) -> None:
    """A session knows nothing of those before it or beside it."""
    alone = _qpos(_run(trial))
    _require_same(trial, "a session starts from nothing", alone, _qpos(_run(trial)))
    ours, other = (trial.reconstructor.begin(trial.calibration) for _ in range(2))
    beside = []
    for mine, theirs in zip(trial.frames, reversed(trial.frames), strict=True):
        beside.append(ours.step(mine))
        other.step(theirs)
    _require_same(trial, "sessions do not meet", alone, _qpos(beside))


def is_causal(trial: Trial) -> None:
    """What comes later changes nothing that was said before; answers are read only once all is over."""
    half = len(trial.frames) // 2
    moved = [
        replace(
            frame,
            position_m=frame.position_m + 0.3,
            received_s=frame.received_s + 0.1,
            measured_s=frame.measured_s + 0.1,
        )
        for frame in trial.frames[half:]
    ]
    plain, perturbed = _qpos(_run(trial)), _qpos(_run(trial, [*trial.frames[:half], *moved]))
    _require_same(trial, "an answer rests on no later frame", plain[:half], perturbed[:half])
    session = trial.reconstructor.begin(trial.calibration)
    spoken = [np.array(session.step(frame).qpos) for frame in trial.frames]
    _require_same(trial, "an answer is not changed afterwards", np.array(spoken), plain)


def bears_losses(trial: Trial) -> None:
    """Single stations, then all of them, fall silent and come back; from the first frame on as well."""
    everyone = range(len(trial.calibration.stations))
    for silent in (*([s] for s in everyone), [*everyone]):
        gone = range(20, 50)
        frames = [without(f, silent) if i in gone else f for i, f in enumerate(trial.frames)]
        for index, estimate in enumerate(_run(trial, frames)):
            _require_pose(trial, index, estimate)
    late = [without(f, everyone) if i < 10 else f for i, f in enumerate(trial.frames)]
    for index, estimate in enumerate(_run(trial, late)):
        _require_pose(trial, index, estimate)


def admits_being_lost(trial: Trial) -> None:
    """SOLVED on good frames, never while nothing reports, LOST once that lasts more than 0.5 s, SOLVED again after."""
    rule = "the status tells what the answer rests on"
    everyone = range(len(trial.calibration.stations))
    gone = range(10, 40)
    frames = [without(f, everyone) if i in gone else f for i, f in enumerate(trial.frames)]
    status = [estimate.status for estimate in _run(trial, frames)]
    if any(status[i] is Status.SOLVED for i in gone):
        _fail(trial, rule, "SOLVED while no station reported")
    if any(status[i] is not Status.LOST for i in gone if frames[i].received_s - frames[9].received_s > 0.5 + 1e-9):
        _fail(trial, rule, "not LOST although nothing had come for more than 0.5 s")
    if status[-1] is not Status.SOLVED or status[9] is not Status.SOLVED:
        _fail(trial, rule, "not SOLVED although every station reported")


def bears_irregular_time(trial: Trial) -> None:
    """Frames may come early, late, or not at all."""
    rng = generator(1, "irregular time")
    kept = [f for f in trial.frames if rng.random() < 0.7]
    shifts = rng.uniform(0.0, 0.02, len(kept))
    frames = [
        replace(f, received_s=f.received_s + s, measured_s=f.measured_s + s) for f, s in zip(kept, shifts, strict=True)
    ]
    for index, estimate in enumerate(_run(trial, frames)):
        _require_pose(trial, index, estimate)


CHECKS: tuple[Callable[[Trial], None], ...] = (
    answers_are_poses,
    is_deterministic,
    begins_anew,
    is_causal,
    bears_losses,
    admits_being_lost,
    bears_irregular_time,
)


def _run(trial: Trial, frames: Sequence[TrackerFrame] | None = None) -> list[Estimate]:
    session = trial.reconstructor.begin(trial.calibration)
    return [session.step(frame) for frame in (trial.frames if frames is None else frames)]


def _poor(frames: Sequence[TrackerFrame]) -> list[TrackerFrame]:
    """Positions only, then orientations only, then nothing but one station."""
    third = len(frames) // 3
    blind = np.zeros(len(frames[0].quality), bool)
    nothing_m, nothing = np.full((len(blind), 3), np.nan), np.full((len(blind), 4), np.nan)
    out = [replace(f, orientation_valid=blind, tracker_from_station=nothing) for f in frames[:third]]
    out += [replace(f, position_valid=blind, position_m=nothing_m) for f in frames[third : 2 * third]]
    return out + [without(f, range(1, len(blind))) for f in frames[2 * third :]]


def _require_pose(trial: Trial, index: int, estimate: Estimate) -> None:
    rule, qpos = "every answer is a pose", np.asarray(estimate.qpos)
    if qpos.shape != (55,) or not np.all(np.isfinite(qpos)):
        _fail(
            trial,
            rule,
            f"frame {index} has {np.count_nonzero(~np.isfinite(qpos))} numbers that are not finite, of {qpos.shape}",
        )
    if abs(float(np.linalg.norm(qpos[3:7])) - 1.0) > 1e-6:
        _fail(trial, rule, f"frame {index} has a root quaternion of length {np.linalg.norm(qpos[3:7]):.6f}")
    if np.any(qpos[:3] < trial.bounds[0]) or np.any(qpos[:3] > trial.bounds[1]):
        _fail(trial, rule, f"frame {index} puts the root at {np.round(qpos[:3], 2)}, far from every station")
    if not isinstance(estimate.status, Status):
        _fail(trial, rule, f"frame {index} has the status {estimate.status!r}")


def _require_same(trial: Trial, rule: str, one: Floats, other: Floats) -> None:
    differing = np.flatnonzero(np.any(one != other, axis=1))
    if len(differing):
        most = float(np.max(np.abs(one - other)))
        _fail(trial, rule, f"{len(differing)} answers differ, the first in frame {differing[0]}, by up to {most:.3g}")


def _qpos(estimates: Sequence[Estimate]) -> Floats:
    return np.array([estimate.qpos for estimate in estimates])


def _fail(trial: Trial, rule: str, seen: str) -> None:
    raise MethodBroken(trial.method.name, rule, seen)
