"""What every reconstructor must do: `check_method(MyMethod())` in your tests, or `harness check my_module:MyMethod`.

The rules judge conduct, not accuracy: a method that always answers with the T-pose keeps them all. Each is a function
that returns what was seen where the rule holds, and raises `Broken` with what was seen where it does not.
"""

import pickle
import random
import threading
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.estimate import Estimate, Status
from harness.core.seeds import generator
from harness.errors import HarnessError, was_interrupted
from harness.reconstruct.contract import Method, Session
from harness.reconstruct.coverage import LOST_AFTER_S
from harness.reconstruct.residuals import Loss, Residuals
from harness.score.angles import wrapped
from harness.testing.frames import exact_frames, without, worn
from harness.testing.trial import (
    DISTURBANCES,
    FRAMES,
    RATE_HZ,
    Frames,
    Trial,
    digest,
    disturbed,
    elsewhere,
    make_trial,
    moved,
    only_orientations,
    only_positions,
    qpos_of,
    told,
    turned,
)

RECOVERED = 1.5
"""An error is that of an undisturbed session again when it is at most so many times as large (issue of the papers'
reconstructors), or larger by no more than `_SLACK`."""
_SLACK_MM = 5.0
_SAME_POSTURE_DEG = 0.5
"""Mean difference of two answers that should be alike: solvers stop early, and sums are rounded."""


class Broken(Exception):
    """What was seen of a rule that is not kept."""


class MethodBroken(HarnessError):
    """A rule of the contract that a method does not keep."""

    def __init__(self, method: str, rule: str, seen: str) -> None:
        super().__init__(method, rule, seen)
        self.method, self.rule, self.seen = self.args

    def __str__(self) -> str:
        return f"{self.method} breaks the rule that {self.rule}: {self.seen}."


@dataclass(frozen=True)
class Finding:
    """One rule, whether the method keeps it, and what was seen."""

    rule: str
    ok: bool
    seen: str

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)


def check_method(method: Method) -> None:
    """Every rule; MethodBroken at the first that does not hold."""
    for finding in examine(method):
        if not finding.ok:
            raise MethodBroken(method.name, finding.rule, finding.seen)


def examine(method: Method) -> Iterator[Finding]:
    """Every rule, one after another, whatever the method raises."""
    trial = make_trial(method)
    for rule, check in RULES.items():
        try:
            yield Finding(rule, True, check(trial))
        except Broken as broken:
            yield Finding(rule, False, str(broken))
        except (Exception, SystemExit) as error:  # a method may raise anything: that is the finding
            if was_interrupted(error):
                raise
            yield Finding(rule, False, f"raised {type(error).__name__}: {error}")


def answers_are_poses(trial: Trial) -> str:
    """Finite numbers, a unit quaternion, a place in the room, a status."""
    return _poses(trial, trial.frames)


def bears_poor_input(trial: Trial) -> str:
    """Positions only, orientations only, one station only, each from the first frame on; and all of it in turn."""
    third, last = FRAMES // 3, range(1, len(trial.calibration.stations))
    for poor in (only_positions, only_orientations, lambda frame: without(frame, last)):
        _poses(trial, [poor(frame) for frame in trial.frames])
    turns = [only_positions] * third + [only_orientations] * third + [lambda frame: without(frame, last)] * third
    return _poses(trial, [poor(frame) for poor, frame in zip(turns, trial.frames, strict=True)])


def bears_losses(trial: Trial) -> str:
    """Single stations, then all of them, fall silent for 0.75 s and come back; and all at the start."""
    everyone = range(len(trial.calibration.stations))
    for silent in (*([s] for s in everyone), [*everyone]):
        _poses(trial, [without(f, silent) if 20 <= i < 50 else f for i, f in enumerate(trial.frames)])
    _poses(trial, [without(f, everyone) if i < 10 else f for i, f in enumerate(trial.frames)])
    return f"{len(everyone) + 2} losses"


def bears_irregular_time(trial: Trial) -> str:
    """Frames come early, late, or not at all."""
    rng = generator(1, "irregular time")
    kept = [f for f in trial.frames if rng.random() < 0.7]
    shifts = rng.uniform(0.0, 0.02, len(kept))
    return _poses(
        trial,
        [
            replace(f, received_s=f.received_s + s, measured_s=f.measured_s + s)
            for f, s in zip(kept, shifts, strict=True)
        ],
    )


def bears_any_quality(trial: Trial) -> str:
    """Quality anywhere above 0, and suspect readings."""
    rng, count = generator(1, "quality"), len(trial.calibration.stations)
    return _poses(
        trial,
        [
            replace(f, quality=rng.uniform(1.0 / 255.0, 1.0, count) ** 2, suspect=rng.random(count) < 0.2)
            for f in trial.frames
        ],
    )


def wears_other_stations(trial: Trial) -> str:
    """One station, three, and seven: a calibration may name any."""
    worn_sets = (
        ("right_wrist",),
        ("left_hand", "right_hand", "torso"),
        ("pelvis", "left_hand", "right_hand", "left_ankle", "right_ankle", "torso", "head"),
    )
    for stations in worn_sets:
        calibration = worn(trial.body, stations)
        frames = exact_frames(trial.body, calibration, trial.truth[:20], RATE_HZ)
        estimates = told(trial.reconstructor.begin(calibration), frames)
        for index, estimate in enumerate(estimates):
            _require_pose(trial, index, estimate)
        if estimates[-1].status is not Status.SOLVED:
            raise Broken(f"{estimates[-1].status.name} although all {len(stations)} stations reported")
    return "sets of " + ", ".join(str(len(stations)) for stations in worn_sets)


def is_deterministic(trial: Trial) -> str:
    """The same examples and frames give the same answers."""
    once, again = (qpos_of(told(trial.begun(1)[0], trial.frames)) for _ in range(2))
    return _same(once, again)


def starts_from_nothing(trial: Trial) -> str:
    """A session knows nothing of the one before it."""
    reconstructor = trial.fitted()
    once, again = (qpos_of(told(reconstructor.begin(trial.calibration), trial.frames)) for _ in range(2))
    return _same(once, again)


def keeps_sessions_apart(trial: Trial) -> str:
    """A session knows nothing of one beside it, whose frames run backwards."""
    alone, ours, other = trial.begun(3)
    plain, beside = qpos_of(told(alone, trial.frames)), []
    for mine, theirs in zip(trial.frames, reversed(trial.frames), strict=True):
        beside.append(ours.step(mine))
        other.step(theirs)
    return _same(plain, qpos_of(beside))


def bears_threads(trial: Trial) -> str:
    """Two sessions step at the same moment, each in a thread of its own."""
    alone, *both = trial.begun(3)
    plain = qpos_of(told(alone, trial.frames))
    together = threading.Barrier(len(both))
    answers: list[list[Estimate]] = [[] for _ in both]
    errors: list[BaseException] = []

    def follow(session: Session, into: list[Estimate]) -> None:
        try:
            for frame in trial.frames:
                together.wait()
                into.append(session.step(frame))
        except BaseException as error:  # told by the caller's thread
            errors.append(error)
            together.abort()

    threads = [threading.Thread(target=follow, args=pair) for pair in zip(both, answers, strict=True)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for error in errors:
        if not isinstance(error, threading.BrokenBarrierError):
            raise error
    for said in answers:
        _same(plain, qpos_of(said))
    return "2 threads"


def bears_another_process(trial: Trial) -> str:
    """What was fitted may be sent to another process and answers there as it does here."""
    here = trial.fitted()
    sent = pickle.dumps(here)
    there = pickle.loads(sent)  # noqa: S301  # our own, of a moment ago
    alone, other = (qpos_of(told(fitted.begin(trial.calibration), trial.frames)) for fitted in (here, there))
    _same(alone, other)
    return f"{len(sent) / 1e6:.1f} MB pickled"


def is_causal(trial: Trial) -> str:
    """What comes later changes nothing that was said before; answers are read again once all is over."""
    half = FRAMES // 2
    later = [
        replace(
            turned(moved(frame, np.array([0.3, 0.3, 0.3])), 0.5),
            received_s=frame.received_s + 0.1,
            measured_s=frame.measured_s + 0.1,
        )
        for frame in trial.frames[half:]
    ]
    one, other = trial.begun(2)
    spoken, estimates = [], []
    for frame in trial.frames:
        estimates.append(one.step(frame))
        spoken.append(np.array(estimates[-1].qpos))
    perturbed = qpos_of(told(other, [*trial.frames[:half], *later]))
    plain = qpos_of(estimates)
    _same(plain[:half], perturbed[:half], "changed by later frames")
    return _same(np.array(spoken), plain, "changed after they were given")


def leaves_examples_alone(trial: Trial) -> str:
    """Fitting and following change none of the examples."""
    examples = trial.examples()
    before = digest(examples)
    reconstructor = trial.method.fit(trial.body, examples, generator(1, "fit"))
    told(reconstructor.begin(trial.calibration), trial.frames[:5])
    if digest(examples) != before:
        raise Broken("the examples are others than before")
    return f"{len(examples)} takes"


def leaves_global_chance_alone(trial: Trial) -> str:
    """Chance comes from the generator that `fit` is given: numpy's and Python's own are left alone."""
    numpys = np.random.mtrand._rand
    kept = numpys.get_state(), random.getstate()
    try:
        numpys.seed(20_110_218)
        random.seed(20_110_218)
        before = repr(numpys.get_state(legacy=False)), random.getstate()
        told(trial.begun(1)[0], trial.frames[:5])
        if (repr(numpys.get_state(legacy=False)), random.getstate()) != before:
            raise Broken("a global generator was seeded or drawn from")
    finally:
        numpys.set_state(kept[0])
        random.setstate(kept[1])
    return "numpy's and Python's own untouched"


def admits_being_lost(trial: Trial) -> str:
    """SOLVED with at least half of the stations; else HELD, LOST once that lasts more than 0.5 s; and back."""
    count = len(trial.calibration.stations)
    for silent in (range(1), range(count // 2), range(count // 2 + 1), range(count)):
        gone = range(10, 40) if 2 * len(silent) > count else range(0)
        frames = [without(f, silent) if 10 <= i < 40 else f for i, f in enumerate(trial.frames)]
        status = [estimate.status for estimate in trial.run(frames)]
        who = f"while {len(silent)} of {count} stations were silent"
        for i in gone:
            for_s = frames[i].received_s - frames[gone.start - 1].received_s
            expected = Status.LOST if for_s > LOST_AFTER_S + 1e-9 else Status.HELD
            if status[i] is not expected and abs(for_s - LOST_AFTER_S) > 1e-9:
                raise Broken(f"{status[i].name} {who}, for {for_s:.2f} s: {expected.name} is right")
        bad = [i for i in range(40) if i not in gone and status[i] is not Status.SOLVED]
        if bad:
            raise Broken(f"{status[bad[0]].name} in frame {bad[0]} {who if bad[0] >= 10 else 'while all reported'}")
        if status[-1] is not Status.SOLVED:
            raise Broken(f"{status[-1].name} half a second after every station reported again")
    return "HELD, LOST after 0.5 s, SOLVED again"


def comes_back(trial: Trial) -> str:
    """1 s after what lasted 1 s the stations' error is at most 1.5 times that of a session which nothing befell.

    Hinges that no station shows are not judged here, for that takes real motion: `harness run recovery` does.
    """
    plain_mm = _station_error_mm(trial, trial.long)
    worst, which = 0.0, ""
    for what in DISTURBANCES:
        frames, judged = disturbed(trial.long, what)
        before, after = (float(x[judged].mean()) for x in (plain_mm, _station_error_mm(trial, frames)))
        seen = f"{after:.2f} mm after {what}, {before:.2f} without"
        if not after <= RECOVERED * before + _SLACK_MM:
            raise Broken(seen)
        if (ratio := after / max(before, _SLACK_MM)) > worst:
            worst, which = ratio, seen
    return which


def does_not_mind_where(trial: Trial) -> str:
    """The posture is the same in a room that is turned and shifted: hinges, tilt and height."""
    other = elsewhere(trial.truth, 2.0, np.array([5.0, -3.0, 0.0]))
    frames = exact_frames(trial.body, trial.calibration, other[:FRAMES], RATE_HZ)
    here, there = (qpos_of(trial.run(f)) for f in (trial.frames, frames))
    apart_rad = np.abs(wrapped(there[:, 7:] - here[:, 7:])).mean(axis=1)
    tilt_rad = rotations.angle_between_rad(*(_level(qpos) for qpos in (here, there)))
    apart_deg = np.rad2deg(np.maximum(apart_rad, tilt_rad)).mean()
    higher_m = float(np.abs(there[:, 2] - here[:, 2]).mean())
    seen = f"{apart_deg:.2g} deg and {1e3 * higher_m:.2g} mm apart on average"
    if not (apart_deg <= _SAME_POSTURE_DEG and 1e3 * higher_m <= _SLACK_MM):
        raise Broken(seen)
    return seen


Rule = Callable[[Trial], str]
RULES: dict[str, Rule] = {
    "every answer is a pose": answers_are_poses,
    "poor input is borne": bears_poor_input,
    "losses are borne": bears_losses,
    "irregular time is borne": bears_irregular_time,
    "any quality is borne": bears_any_quality,
    "any set of stations is borne": wears_other_stations,
    "equal input gives equal answers": is_deterministic,
    "a session starts from nothing": starts_from_nothing,
    "sessions do not meet": keeps_sessions_apart,
    "sessions may run in threads": bears_threads,
    "what was fitted may go to another process": bears_another_process,
    "an answer rests on no later frame": is_causal,
    "examples stay as they are": leaves_examples_alone,
    "chance is the generator given": leaves_global_chance_alone,
    "the status tells what the answer rests on": admits_being_lost,
    "the error comes back to what it was": comes_back,
    "the posture does not depend on the place": does_not_mind_where,
}
"""What they are called, in the order in which they are tried."""


def _poses(trial: Trial, frames: Frames) -> str:
    for index, estimate in enumerate(trial.run(frames)):
        _require_pose(trial, index, estimate)
    return f"{len(frames)} frames"


def _require_pose(trial: Trial, index: int, estimate: Estimate) -> None:
    qpos = np.asarray(estimate.qpos)
    if qpos.shape != (55,) or not np.all(np.isfinite(qpos)):
        wrong = np.count_nonzero(~np.isfinite(qpos))
        raise Broken(f"frame {index} has {wrong} numbers that are not finite, of {qpos.shape}")
    if abs(float(np.linalg.norm(qpos[3:7])) - 1.0) > 1e-6:
        raise Broken(f"frame {index} has a root quaternion of length {np.linalg.norm(qpos[3:7]):.6f}")
    if np.any(qpos[:3] < trial.bounds[0]) or np.any(qpos[:3] > trial.bounds[1]):
        raise Broken(f"frame {index} puts the root at {np.round(qpos[:3], 2)}, far from every station")
    if not isinstance(estimate.status, Status):
        raise Broken(f"frame {index} has the status {estimate.status!r}")


def _same(one: Floats, other: Floats, how: str = "differ") -> str:
    differing = np.flatnonzero(np.any(one != other, axis=1))
    if len(differing):
        most = float(np.max(np.abs(one - other)))
        raise Broken(f"{len(differing)} answers {how}, the first in frame {differing[0]}, by up to {most:.3g}")
    return f"{len(one)} answers to the bit"


def _station_error_mm(trial: Trial, frames: Frames) -> Floats:
    """(T,) of a new session: mean distance of the stations from where undisturbed readings have them [mm]."""
    judge, off_m = Residuals(trial.body, trial.calibration, Loss()), []
    for frame, qpos in zip(trial.long, qpos_of(trial.run(frames)), strict=False):
        judge.read(frame)
        judge.place(qpos)
        off_m.append(judge.distance[: len(judge.bones)].mean())
    return 1e3 * np.array(off_m)


def _level(qpos: Floats) -> Floats:
    """(T, 4) root orientations without their heading."""
    return rotations.multiply(rotations.about_z(-rotations.yaw_rad(qpos[:, 3:7])), qpos[:, 3:7])
