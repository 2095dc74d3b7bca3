"""Compile everything that is compiled, once and for all: `python -m harness.testing.compile_all`.

Functions are compiled when they are first called and kept on disk (`core.compiled`), which takes about a minute in all.
Here every method follows a few frames, with all stations and with some missing, so that no first run has to wait.
"""

import numpy as np

from harness.errors import HarnessError
from harness.reconstruct import registry
from harness.stream.frame import TrackerFrame
from harness.testing.contract_case import keep_positions, make_case, run_session

_FRAMES = 8


def compile_all() -> None:
    """Let every registered method follow a few frames; HarnessError when one cannot."""
    for name in registry.methods():
        if ":" in name:  # a preset, of the same code
            continue
        trial = make_case(registry.resolve(name))
        frames: list[TrackerFrame] = list(trial.frames[:_FRAMES])
        for seen in (frames, [keep_positions(frame) for frame in frames]):
            answers = run_session(trial.reconstructor.begin(trial.calibration), seen)
            if not all(np.isfinite(answer.qpos).all() for answer in answers):
                raise HarnessError(f"{name} gave an answer that is not finite.")


if __name__ == "__main__":
    compile_all()
