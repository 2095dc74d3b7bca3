"""Compile all compiled functions in advance: `python -m harness.testing.compile_all`.

A function is compiled when it is first called and then cached on disk (`core.compiled`). All of them take about a
minute. Here every method follows a few frames, with full and with partial readings, and a physical tracker is
simulated, so that the first run need not wait.
"""

import numpy as np

from harness.body import DEFAULT_MOUNTS, retarget_to_own_body
from harness.core.progress import ProgressCallback
from harness.errors import HarnessError
from harness.mocap import synthetic
from harness.reconstruct import list_methods, make_method
from harness.simulate import Noise, SoftTissueArtefact, TrackerConfig, simulate_tracker
from harness.simulate.physics import Physics
from harness.stream import TrackerFrame
from harness.testing.contract_case import keep_positions, make_case, run_session

_FRAMES = 8


def compile_all(progress: ProgressCallback = lambda name, done, planned: None) -> None:
    """Run every registered method on a few frames; HarnessError when an estimate is not finite."""
    names = [name for name in (*list_methods(), "ik[align=true]") if ":" not in name]  # a preset is the same code
    for done, name in enumerate(names):
        progress(name, done, len(names) + 1)
        case = make_case(make_method(name))
        frames: list[TrackerFrame] = list(case.frames[:_FRAMES])
        for readings in (frames, [keep_positions(frame) for frame in frames]):
            estimates = run_session(case.reconstructor.begin(case.calibration), readings)
            if not all(np.isfinite(estimate.qpos).all() for estimate in estimates):
                raise HarnessError(f"{name} returned an estimate that is not finite.")
    progress("physical tracker", len(names), len(names) + 1)
    _simulate_physical_tracker()


def _simulate_physical_tracker() -> None:
    """Simulate a second of boxing with a physical tracker on soft tissue."""
    clip = synthetic.generate("boxing", synthetic.performer_names()[0], 1, seed=1, duration_s=1.0)
    noise = Noise(soft_tissue=SoftTissueArtefact(), physics=Physics())
    body, take = retarget_to_own_body(clip)
    simulate_tracker(body, take, [DEFAULT_MOUNTS["right_hand"]], TrackerConfig(), noise, seed=1)


def _print_step(name: str, done: int, planned: int) -> None:
    print(f"  compiling {name} ({done + 1} of {planned})", flush=True)


if __name__ == "__main__":
    compile_all(_print_step)
