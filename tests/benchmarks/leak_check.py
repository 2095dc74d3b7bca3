"""Time in which a test clip is compared with 500 examples, by content (see `harness.mocap.shared_motion`)."""

from dataclasses import replace

from harness.bench.cpu_time import hold_cpu_to_limit, time_cpu
from harness.core.motion import Clip
from harness.mocap import find_shared_motion, synthetic
from harness.results.findings import BenchmarkStatement

EXAMPLES = 500
MAX_UNITS = 7.0
"""Most CPU time (see `harness.bench.cpu_time`)."""
_TAKES = (1, 2, 3)


def bench_leak_check(seed: int, examples: int = EXAMPLES) -> list[BenchmarkStatement]:
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
    name = f"leak check, one clip against {examples} of 20 s"
    return [hold_cpu_to_limit(name, first_s, MAX_UNITS, f"again {again_s:.2f} s CPU")]


def _check(test: Clip, examples: list[Clip]) -> float:
    """CPU time in which the test clip is compared with all examples [s]."""

    def compare() -> None:
        for example in examples:
            find_shared_motion(test, [range(len(test))], example, [range(len(example))])

    return time_cpu(compare)
