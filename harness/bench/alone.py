"""One method in a process of its own: its speed, and the memory that it takes above an empty process.

    python -m harness.bench.alone METHOD FOLDER SEED

prints JSON. With METHOD "nothing" the process does all that is not learning: it has loaded everything, libraries of
linear algebra with their work space too, made the frames, and stepped through them once with plain inverse kinematics.
"""

import json
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import solve

from harness.bench import trials
from harness.core.seeds import generator
from harness.reconstruct import registry
from harness.reconstruct.contract import Reconstructor
from harness.reconstruct.database import MotionDatabase

NOTHING = "nothing"
SECONDS = 4.0
"""Of every held-out take."""
_STATUS = Path("/proc/self/status")


@dataclass(frozen=True)
class Alone:
    """What a process found out about itself."""

    fit_s: float
    step_ms: float
    """Median."""
    peak_bytes: int
    """Largest resident memory of the whole process."""


def run_alone(method: str, folder: Path, seed: int) -> Alone:
    """In a fresh process; RuntimeError when that fails."""
    command = [sys.executable, "-m", "harness.bench.alone", method, str(folder), str(seed)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{method} alone: {done.stderr.strip()[-2000:]}")
    return Alone(**json.loads(done.stdout))


def alone(name: str, folder: Path, seed: int) -> Alone:
    """In this process."""
    _load_libraries()
    body, shown = trials.body(), trials.trials(seed, SECONDS)
    warm = registry.resolve("ik:previous").fit(body, [], generator(seed, "bench", "alone"))
    step_ms = _steps_ms(warm, shown)
    start = time.perf_counter()
    if name == NOTHING:
        return Alone(0.0, float(np.median(step_ms)), peak_bytes())
    fitted = trials.fitted(registry.resolve(name), body, MotionDatabase.open(folder), generator(seed, "method", name))
    fit_s = time.perf_counter() - start
    step_ms = _steps_ms(fitted, shown)
    return Alone(fit_s, float(np.median(step_ms)), peak_bytes())


def _load_libraries() -> None:
    """What any program that multiplies matrices and searches holds, whatever it learns from."""
    import faiss

    matrix = np.eye(160)
    for some in (matrix, matrix.astype(np.float32)):
        solve(some @ some, some, assume_a="pos")
    np.linalg.eigh(matrix)
    faiss.IndexFlatL2(8).add(np.zeros((1, 8), np.float32))


def _steps_ms(fitted: Reconstructor, shown: list[trials.Trial]) -> list[float]:
    spent = []
    for trial in shown:
        session = fitted.begin(trial.simulation.calibration)
        for which, frame in enumerate(trial.simulation.frames):
            start = time.perf_counter()
            session.step(frame)
            if which >= trials.WARM_UP:
                spent.append(1e3 * (time.perf_counter() - start))
    return spent


def peak_bytes() -> int:
    """Of this program; `getrusage` would count what the parent held when it started this one."""
    if _STATUS.is_file():
        line = next(line for line in _STATUS.read_text().splitlines() if line.startswith("VmHWM:"))
        return 1024 * int(line.split()[1])
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


if __name__ == "__main__":
    print(json.dumps(asdict(alone(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])))))
