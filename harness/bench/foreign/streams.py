"""The streams of `HARNESS_REAL`: pairs of one rigid body, and single ones."""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

from harness.errors import BadInput

REAL_VARIABLE = "HARNESS_REAL"
"""Variable of the environment that names the folder of real streams."""
_REFERENCES = ("vicon", "hand", "odometry")
"""Streams that are the reference of a pair, the best first; else the first by name."""


class NoRealStreams(BadInput):
    """No folder of real streams was named."""


@dataclass(frozen=True)
class StreamPair:
    """Files of two streams of one rigid body."""

    name: str
    capture: Path
    truth: Path


def real_folder() -> Path:
    """The folder of real streams. NoRealStreams without one."""
    folder = Path(os.environ.get(REAL_VARIABLE) or "/nonexistent")
    if not (folder / "hand_eye").is_dir():
        advice = f"Set {REAL_VARIABLE} to a folder with hand_eye/SET/STREAM.csv; nothing measured is no pass."
        raise NoRealStreams("No real streams.", advice)
    return folder


def stream_pairs(folder: Path) -> Iterator[StreamPair]:
    """All pairs of streams of each set in `hand_eye/`."""
    for place in sorted(path for path in (folder / "hand_eye").iterdir() if path.is_dir()):
        files = sorted(place.glob("*.csv"), key=lambda path: (_rank(path.stem), path.stem))
        for truth, capture in combinations(files, 2):
            yield StreamPair(f"{place.name} {capture.stem}, {truth.stem}", capture, truth)


def _rank(name: str) -> int:
    return _REFERENCES.index(name) if name in _REFERENCES else len(_REFERENCES)


def matrix_files(folder: Path) -> list[Path]:
    """Files of matrices without times, in `polhemus/`."""
    return sorted((folder / "polhemus").glob("*.traj"))
