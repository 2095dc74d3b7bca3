"""Rules about estimates that are identical to the bit (repeated, parallel, causal), and about side effects."""

import random
import threading
from dataclasses import replace

import numpy as np

from harness.core.arrays import Floats
from harness.core.calibration import Calibration
from harness.core.estimate import Estimate
from harness.core.seeds import generator
from harness.core.workers import run_in_workers
from harness.reconstruct import Reconstructor, Session
from harness.testing.contract_case import (
    FRAMES,
    ContractCase,
    Frames,
    RuleViolation,
    hash_motions,
    offset_positions,
    require_identical,
    rotate_orientations,
    run_session,
    stack_qpos,
)


def is_deterministic(case: ContractCase) -> str:
    """Repeating a session with equal examples and frames gives equal estimates."""
    first, second = (stack_qpos(run_session(case.begin_sessions(1)[0], case.frames)) for _ in range(2))
    return require_identical(first, second)


def starts_without_history(case: ContractCase) -> str:
    """A session is not affected by the session before it."""
    reconstructor = case.fit()
    first, second = (stack_qpos(run_session(reconstructor.begin(case.calibration), case.frames)) for _ in range(2))
    return require_identical(first, second)


def isolates_sessions(case: ContractCase) -> str:
    """A session is not affected by a simultaneous one whose frames run backwards."""
    alone, tested, other = case.begin_sessions(3)
    expected, interleaved = stack_qpos(run_session(alone, case.frames)), []
    for frame, other_frame in zip(case.frames, reversed(case.frames), strict=True):
        interleaved.append(tested.step(frame))
        other.step(other_frame)
    return require_identical(expected, stack_qpos(interleaved))


def is_thread_safe(case: ContractCase) -> str:
    """Two sessions step at the same time, each in a thread of its own."""
    alone, *sessions = case.begin_sessions(3)
    expected = stack_qpos(run_session(alone, case.frames))
    barrier = threading.Barrier(len(sessions))
    estimates: list[list[Estimate]] = [[] for _ in sessions]
    errors: list[BaseException] = []

    def follow(session: Session, output: list[Estimate]) -> None:
        try:
            for frame in case.frames:
                barrier.wait()
                output.append(session.step(frame))
        except BaseException as error:  # raised again in the caller's thread
            errors.append(error)
            barrier.abort()

    threads = [threading.Thread(target=follow, args=pair) for pair in zip(sessions, estimates, strict=True)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for error in errors:
        if not isinstance(error, threading.BrokenBarrierError):
            raise error
    for output in estimates:
        require_identical(expected, stack_qpos(output))
    return "2 sessions in 2 threads"


def works_in_another_process(case: ContractCase) -> str:
    """The fitted method can be sent to another process and gives the same estimates there."""
    task = case.fit(), case.calibration, case.frames
    ((_, future),) = run_in_workers(estimate_qpos, [task], 1)
    return require_identical(estimate_qpos(*task), future.result())


def is_causal(case: ContractCase) -> str:
    """Later frames do not change earlier estimates, and an estimate does not change after it was returned."""
    half = FRAMES // 2
    perturbed_frames = [
        replace(
            rotate_orientations(offset_positions(frame, np.array([0.3, 0.3, 0.3])), 0.5),
            received_s=frame.received_s + 0.1,
            measured_s=frame.measured_s + 0.1,
        )
        for frame in case.frames[half:]
    ]
    session, other = case.begin_sessions(2)
    copies, estimates = [], []
    for frame in case.frames:
        estimates.append(session.step(frame))
        copies.append(np.array(estimates[-1].qpos))
    perturbed = stack_qpos(run_session(other, [*case.frames[:half], *perturbed_frames]))
    final = stack_qpos(estimates)
    require_identical(final[:half], perturbed[:half], "depend on later frames")
    return require_identical(np.array(copies), final, "changed after they were returned")


def estimate_qpos(fitted: Reconstructor, calibration: Calibration, frames: Frames) -> Floats:
    """(F, 55) estimates of a new session."""
    return stack_qpos(run_session(fitted.begin(calibration), frames))


def preserves_examples(case: ContractCase) -> str:
    """Fitting and stepping do not modify the examples."""
    examples = case.examples()
    before = hash_motions(examples)
    reconstructor = case.method.fit(case.body, examples, generator(1, "fit"))
    run_session(reconstructor.begin(case.calibration), case.frames[:5])
    if hash_motions(examples) != before:
        raise RuleViolation("the examples were modified")
    return f"{len(examples)} takes are unchanged"


def preserves_global_random_state(case: ContractCase) -> str:
    """Random numbers come from the generator that `fit` receives, not from those of numpy and Python."""
    global_generator = np.random.mtrand._rand
    saved = global_generator.get_state(), random.getstate()
    try:
        global_generator.seed(20_110_218)
        random.seed(20_110_218)
        before = repr(global_generator.get_state(legacy=False)), random.getstate()
        run_session(case.begin_sessions(1)[0], case.frames[:5])
        if (repr(global_generator.get_state(legacy=False)), random.getstate()) != before:
            raise RuleViolation("a global random generator of numpy or Python was seeded or drawn from")
    finally:
        global_generator.set_state(saved[0])
        random.setstate(saved[1])
    return "those of numpy and Python are unchanged"
