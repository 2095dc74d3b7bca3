"""Time in which a test clip is compared with 500 examples, by content (see `harness.mocap.shared_motion`)."""

import time
from dataclasses import replace

from harness.bench.rows import BenchmarkRow
from harness.core.motion import Clip
from harness.mocap import synthetic
from harness.mocap.shared_motion import find_shared_motion

EXAMPLES = 500
_TAKES = (1, 2, 3)


def bench_leak_check(seed: int, examples: int = EXAMPLES) -> list[BenchmarkRow]:
    """CPU time of the check on takes of 20 s: at first, and when the examples are known from another test clip."""
    test, *others = (
        synthetic.generate(behaviour, performer, take, seed=seed)
        for behaviour in synthetic.BEHAVIOURS
        for performer in ("p1", "p2")
        for take in _TAKES
    )
    _check(test, others[:1])  # compiles
    clips = [replace(others[number % len(others)], name=f"example {number}") for number in range(examples)]
    first_s, again_s = (_check(test, clips) for _ in range(2))
    return [
        BenchmarkRow(
            f"leak check, one clip against {examples} of 20 s", first_s, "s CPU", f"again: {again_s:.2f} s CPU", "< 1"
        )
    ]


def _check(test: Clip, examples: list[Clip]) -> float:
    """CPU time in which the test clip is compared with all examples [s]."""
    start_s = time.process_time()
    for example in examples:
        find_shared_motion(test, [range(len(test))], example, [range(len(example))])
    return time.process_time() - start_s
