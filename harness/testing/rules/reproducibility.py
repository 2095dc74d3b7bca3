"""Rules about answers that must be the same to the bit: again, beside another session, elsewhere, whatever follows."""

import threading
from dataclasses import replace

import numpy as np

from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.workers import run_in_workers
from harness.reconstruct.contract import Reconstructor, Session
from harness.testing.contract_case import (
    FRAMES,
    ContractCase,
    Frames,
    offset_positions,
    rotate_orientations,
    run_session,
    stack_qpos,
)
from harness.testing.rules.assertions import require_identical


def is_deterministic(trial: ContractCase) -> str:
    """The same examples and frames give the same answers."""
    once, again = (stack_qpos(run_session(trial.begin_sessions(1)[0], trial.frames)) for _ in range(2))
    return require_identical(once, again)


def starts_without_history(trial: ContractCase) -> str:
    """A session knows nothing of the one before it."""
    reconstructor = trial.fit()
    once, again = (stack_qpos(run_session(reconstructor.begin(trial.calibration), trial.frames)) for _ in range(2))
    return require_identical(once, again)


def isolates_sessions(trial: ContractCase) -> str:
    """A session knows nothing of one beside it, whose frames run backwards."""
    alone, ours, other = trial.begin_sessions(3)
    plain, beside = stack_qpos(run_session(alone, trial.frames)), []
    for mine, theirs in zip(trial.frames, reversed(trial.frames), strict=True):
        beside.append(ours.step(mine))
        other.step(theirs)
    return require_identical(plain, stack_qpos(beside))


def is_thread_safe(trial: ContractCase) -> str:
    """Two sessions step at the same moment, each in a thread of its own."""
    alone, *both = trial.begin_sessions(3)
    plain = stack_qpos(run_session(alone, trial.frames))
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
        require_identical(plain, stack_qpos(said))
    return "2 threads"


def works_in_another_process(trial: ContractCase) -> str:
    """What was fitted is sent to another process, where it answers as it does here."""
    task = trial.fit(), trial.calibration, trial.frames
    ((_, there),) = run_in_workers(estimate_qpos, [task], 1)
    return require_identical(estimate_qpos(*task), there.result())


def is_causal(trial: ContractCase) -> str:
    """What comes later changes nothing that was said before; answers are read again once all is over."""
    half = FRAMES // 2
    later = [
        replace(
            rotate_orientations(offset_positions(frame, np.array([0.3, 0.3, 0.3])), 0.5),
            received_s=frame.received_s + 0.1,
            measured_s=frame.measured_s + 0.1,
        )
        for frame in trial.frames[half:]
    ]
    one, other = trial.begin_sessions(2)
    spoken, estimates = [], []
    for frame in trial.frames:
        estimates.append(one.step(frame))
        spoken.append(np.array(estimates[-1].qpos))
    perturbed = stack_qpos(run_session(other, [*trial.frames[:half], *later]))
    plain = stack_qpos(estimates)
    require_identical(plain[:half], perturbed[:half], "changed by later frames")
    return require_identical(np.array(spoken), plain, "changed after they were given")


def estimate_qpos(fitted: Reconstructor, calibration: Calibration, frames: Frames) -> Floats:
    """(F, 55) of a new session."""
    return stack_qpos(run_session(fitted.begin(calibration), frames))
