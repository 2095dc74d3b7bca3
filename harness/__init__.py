"""Measure how well body-worn 6-DOF trackers are turned into full-body motion.

The public names, which are imported when they are first used:

| name             | what it does                                                                          |
|------------------|---------------------------------------------------------------------------------------|
| `load_scenario`  | reads a scenario: a TOML file, or the name of a shipped one                           |
| `run`            | runs a scenario into a folder: every test clip with every method                      |
| `load`           | loads the folder of a run or sweep: results of each cell, arrays of each frame        |
| `compare_runs`   | compares two results and tells whether the second is worse                            |
| `methods`        | lists the registered methods by name                                                  |
| `read_clip`      | reads a motion file: AMC, BVH, MVNX or AMASS npz                                      |
| `simulate_clip`  | simulates what a tracker reports while a clip is performed                            |
| `score_estimate` | scores an estimated motion against the truth                                          |
| `Is900`          | reads frames from an IS-900 at a serial port or TCP address                           |
| `Emulator`       | plays readings as an IS-900 would, byte by byte, without a port                       |
| `serve_emulator` | puts such an emulator at a pseudo terminal or TCP port                                |
| `HarnessError`   | the base class of every error that the package raises on purpose                      |
"""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.compare import compare_runs
    from harness.core.package_data import VERSION as __version__
    from harness.errors import HarnessError
    from harness.experiment import run, simulate_clip
    from harness.experiment.scenarios import load_scenario
    from harness.mocap import read_clip
    from harness.reconstruct import list_methods as methods
    from harness.results import load_run as load
    from harness.score import score_estimate
    from harness.stream import serve_emulator
    from harness.stream.is900 import Emulator, Is900
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "Emulator",
    "HarnessError",
    "Is900",
    "__version__",
    "compare_runs",
    "load",
    "load_scenario",
    "methods",
    "read_clip",
    "run",
    "score_estimate",
    "serve_emulator",
    "simulate_clip",
]
