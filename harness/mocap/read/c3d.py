"""C3D files: positions of markers, read by ezc3d (extra `c3d`), in world axes and metres.

The header is checked first, and ezc3d runs in a process of its own, because it does not check its input. Unit and axes
come from the file's parameters (POINT:UNITS, POINT:X_SCREEN and Y_SCREEN;
https://www.c3d.org/HTML/Documents/parameterslist.htm). CMU's files are in millimetres, with x across the screen and z
up, which are the world's x and z.
"""

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.core.arrays import Floats, freeze
from harness.core.child_process import PythonProcess
from harness.core.motion import Clip
from harness.core.npz_file import read_npz
from harness.core.skeleton import forward_kinematics
from harness.errors import BadFile, MissingExtra
from harness.mocap.read import ezc3d_process
from harness.mocap.read.c3d_header import check_header
from harness.mocap.read.file_checks import MAX_VALUE, check_size

UNITS_M = {"mm": 0.001, "cm": 0.01, "m": 1.0, "in": 0.0254}

TIMEOUT_S = 20.0
"""Time limit for ezc3d [s], to which `BYTES_PER_SECOND` adds for large files; it needs 0.1 s for CMU's."""
BYTES_PER_SECOND = 2e6

_FORMAT = "a C3D marker file"
_FETCH_AGAIN = "Fetch or export it again."
_WORLD_FROM_FILE = {
    ("+X", "+Z"): np.eye(3),
    ("+Y", "+Z"): np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    ("+X", "+Y"): np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
}
"""Rotation to world axes by the file's axes across and up the screen."""


@dataclass(frozen=True, eq=False)
class MarkerClip:
    """T frames of M markers in world axes (z up)."""

    name: str
    subject: str
    labels: tuple[str, ...]
    """(M,) names without the subject's prefix ("LFHD")."""
    rate_hz: float
    position_m: Floats
    """(T, M, 3) positions [m]; NaN where a marker was not seen."""
    unit_m: float
    unit_evidence: str
    """Evidence for the unit."""
    up_evidence: str
    """The file's axis that points up, with the evidence."""

    def __post_init__(self) -> None:
        freeze(self, position_m=("T", len(self.labels), 3))

    def __len__(self) -> int:
        return len(self.position_m)


def read_c3d(path: Path | str, *, unit_m: float | None = None) -> MarkerClip:
    """Read the markers of a C3D file; `unit_m` is the length of 1 in it, if the file does not say it [m].

    Raises BadFile for a damaged file or one without unit or axes, and MissingExtra without ezc3d.
    """
    path = Path(path)
    check_size(path, _FORMAT)
    check_header(path)
    content = _load_with_ezc3d(path)
    unit, unit_evidence = _length_unit(path, _stripped_strings(content["UNITS"]), unit_m)
    screen = tuple((_stripped_strings(content[key]) or [""])[0] for key in ("X_SCREEN", "Y_SCREEN"))
    if screen not in _WORLD_FROM_FILE:
        found = f"POINT:X_SCREEN {screen[0]!r} and Y_SCREEN {screen[1]!r}"
        known = " or ".join(f"{across} and {up}" for across, up in _WORLD_FROM_FILE)
        raise BadFile(path, found, f"{known}, which say where up is", "Set them in the program that wrote it.")
    points = content["points"]
    seen = (content["residuals"] >= 0.0) & np.all(np.abs(points) < MAX_VALUE, axis=0)
    labels = _stripped_strings(content["labels"])
    rate_hz = float(content["rate_hz"])
    if points.shape[1] != len(labels) or points.shape[2] == 0 or not 0.0 < rate_hz < 1e5:
        found = f"{points.shape[1]} markers, {len(labels)} labels, {points.shape[2]} frames, {rate_hz:g} Hz"
        raise BadFile(path, found, "a label for each marker, frames and a rate", _FETCH_AGAIN)
    position: Floats = np.moveaxis(np.where(seen, points, np.nan), 0, -1)
    return MarkerClip(
        name=path.stem,
        subject=path.stem.split("_", 1)[0],
        labels=tuple(label.split(":")[-1] for label in labels),
        rate_hz=rate_hz,
        position_m=np.moveaxis(position, 0, 1) * unit @ _WORLD_FROM_FILE[screen].T,
        unit_m=unit,
        unit_evidence=unit_evidence,
        up_evidence=f"{screen[1].removeprefix('+').lower()} (POINT:Y_SCREEN is {screen[1]})",
    )


def _load_with_ezc3d(path: Path) -> dict[str, NDArray[Any]]:
    """Run `ezc3d_process` and read its arrays; BadFile if ezc3d refuses the file, crashes or does not finish."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "content.npz"
        timeout_s = TIMEOUT_S + path.stat().st_size / BYTES_PER_SECOND
        with PythonProcess(ezc3d_process.__name__, str(path.absolute()), str(out), cwd=folder) as process:
            ended = process.finish(timeout_s)
        if ended is None:
            raise BadFile(path, f"a file that keeps ezc3d busy over {timeout_s:.0f} s", _FORMAT, _FETCH_AGAIN)
        if process.returncode == ezc3d_process.NO_EZC3D:
            raise MissingExtra("Reading C3D files", "ezc3d", "c3d")
        if process.returncode != 0:
            refused = process.returncode == ezc3d_process.UNREADABLE
            why = ended[1].strip().splitlines()[-1:] if refused else ["it crashes"]
            raise BadFile(path, f"a file that ezc3d cannot read ({' '.join(why)})", _FORMAT, _FETCH_AGAIN)
        return read_npz(out, "what ezc3d read", _FETCH_AGAIN, limit_bytes=ezc3d_process.MEMORY_LIMIT_BYTES)


@dataclass(frozen=True)
class MarkerSpread:
    """Spread of a marker about the bone that it follows best."""

    label: str
    bone: str
    spread_m: float
    """Standard deviation of its position in the bone's frame, over all three axes [m]."""


def measure_marker_spreads(markers: MarkerClip, clip: Clip) -> tuple[MarkerSpread, ...]:
    """The bone of least spread for each marker, in a clip of the same take with the same frames.

    Markers that were seen in fewer than two frames are left out.
    """
    frames = min(len(markers), len(clip))
    pose = forward_kinematics(
        clip.skeleton, clip.root_m[:frames], clip.world_from_root[:frames], clip.angles_rad[:frames]
    )
    spreads = []
    for m, label in enumerate(markers.labels):
        seen = np.isfinite(markers.position_m[:frames, m, 0])
        if seen.sum() < 2:
            continue
        away = markers.position_m[:frames, m, None][seen] - pose.start_m[seen]
        local = np.einsum("tbij,tbi->tbj", pose.world_from_bone[seen], away)
        spread = np.sqrt(np.sum(np.var(local, axis=0), axis=-1))
        best = int(np.argmin(spread))
        spreads.append(MarkerSpread(label, clip.skeleton.names[best], float(spread[best])))
    return tuple(spreads)


def _length_unit(path: Path, units: list[str], given_m: float | None) -> tuple[float, str]:
    """Unit of length [m] and the evidence; BadFile if neither the file nor the caller gives one."""
    if given_m is not None:
        return given_m, "unit as given"
    if not units or units[0].lower() not in UNITS_M:
        found = f"POINT:UNITS {units[0]!r}" if units else "no POINT:UNITS"
        raise BadFile(path, found, f"one of {', '.join(UNITS_M)}", "Give the unit's length in metres (--unit).")
    return UNITS_M[units[0].lower()], f"{units[0]}, from POINT:UNITS"


def _stripped_strings(values: NDArray[Any]) -> list[str]:
    return [str(value).strip() for value in values]
