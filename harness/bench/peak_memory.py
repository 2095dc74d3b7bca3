"""Peak memory of one method in a process of its own.

    python -m harness.bench.peak_memory METHOD FOLDER SEED

prints the peak in bytes. With METHOD "nothing" the process is a baseline without a learning method: it loads the
linear algebra with its work space, makes the frames, and follows them with plain inverse kinematics.
"""

import sys
from pathlib import Path

import numpy as np
from scipy.linalg import solve

from harness.core.child_process import run_python
from harness.core.seeds import generator
from harness.reconstruct import MotionDatabase, Reconstructor, make_method
from harness.study.speed import benchmark_clips

NO_METHOD = "nothing"
CLIP_S = 4.0
"""Length of every held-out take [s]."""
_STATUS = Path("/proc/self/status")


def measure_peak_bytes(method: str, folder: Path, seed: int) -> int:
    """Peak resident memory of a new process that runs the method [bytes]; RuntimeError when it fails."""
    return int(run_python("harness.bench.peak_memory", method, str(folder), str(seed)))


def run_method(name: str, folder: Path, seed: int) -> int:
    """Run the method in this process; returns its peak resident memory [bytes]."""
    _load_libraries()
    body, clips = benchmark_clips.build_common_body(), benchmark_clips.generate_held_out_clips(seed, CLIP_S)
    _run_sessions(make_method("ik:previous").fit(body, [], generator(seed, "bench", "alone")), clips)
    if name != NO_METHOD:
        database = MotionDatabase.open(folder)
        _run_sessions(benchmark_clips.fit_named_method(name, database, seed), clips)
    return peak_bytes()


def _load_libraries() -> None:
    """Load the libraries that every method uses, with their work space."""
    matrix = np.eye(160)
    for typed in (matrix, matrix.astype(np.float32)):
        solve(typed @ typed, typed, assume_a="pos")
    np.linalg.eigh(matrix)


def _run_sessions(fitted: Reconstructor, clips: list[benchmark_clips.BenchmarkClip]) -> None:
    for clip in clips:
        session = fitted.begin(clip.simulation.calibration)
        for frame in clip.simulation.frames:
            session.step(frame)


def peak_bytes() -> int:
    """Peak resident memory of this process [bytes]; `getrusage` would include that of the parent when it forked."""
    if _STATUS.is_file():
        line = next(line for line in _STATUS.read_text().splitlines() if line.startswith("VmHWM:"))
        return 1024 * int(line.split()[1])
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


if __name__ == "__main__":
    print(run_method(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3])))
