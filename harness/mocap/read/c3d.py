"""C3D files: positions of markers, in world axes and metres.

Unit and axes come from the file's parameters (POINT:UNITS, POINT:X_SCREEN and Y_SCREEN;
https://www.c3d.org/HTML/Documents/parameterslist.htm). CMU's files are in millimetres, with x across the screen and z
up, which are the world's x and z. A marker with a residual below zero was not seen, nor was one at exactly (0, 0, 0)
with the residual 0, which some programs write for it.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.core.arrays import Floats, freeze
from harness.core.input_file import read_input_file
from harness.core.motion import Clip
from harness.core.skeleton import forward_kinematics
from harness.core.units import LENGTH_UNITS_M, find_unit
from harness.errors import BadFile
from harness.mocap.read.c3d_header import FETCH_AGAIN, FORMAT, C3dHeader, count_frames, read_header
from harness.mocap.read.file_checks import LIMIT_BYTES, MAX_VALUE, check_size

_RESIDUALS = 256.0
"""The low byte of the fourth value of a marker is its residual, the high byte the cameras that saw it."""
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
    """(M,) names without the subject's prefix ("LFHD"), or with it where several subjects have one name."""
    rate_hz: float
    position_m: Floats
    """(T, M, 3) positions [m]; NaN where a marker was not seen."""
    unit_m: float
    unit_evidence: str
    """Evidence for the unit."""
    up_evidence: str
    """The file's axis that points up, with the evidence."""
    notes: tuple[str, ...] = ()
    """What was read with doubt, a sentence each."""

    def __post_init__(self) -> None:
        freeze(self, position_m=("T", len(self.labels), 3))

    def __len__(self) -> int:
        return len(self.position_m)


def read_c3d(path: Path | str, *, unit_m: float | None = None) -> MarkerClip:
    """Read the markers of a C3D file; `unit_m` is the length of 1 in it, if the file does not say it [m].

    Raises BadFile for a damaged file, and for one without unit or axes.
    """
    path = Path(path)
    check_size(path, FORMAT)
    data = read_input_file(path, FORMAT, LIMIT_BYTES)
    header = read_header(path, data)
    unit, unit_evidence = _length_unit(path, header.texts("POINT:UNITS"), unit_m)
    screen = tuple((header.texts(f"POINT:{axis}_SCREEN") or ("",))[0] for axis in "XY")
    if screen not in _WORLD_FROM_FILE:
        found = f"POINT:X_SCREEN {screen[0]!r} and Y_SCREEN {screen[1]!r}"
        known = " or ".join(f"{across} and {up}" for across, up in _WORLD_FROM_FILE)
        raise BadFile(path, found, f"{known}, which say where up is", "Set them in the program that wrote it.")
    labels = [label for key in _label_keys(header) for label in header.texts(key)]
    if header.markers != len(labels) or not 0.0 < header.rate_hz < 1e5:
        found = f"{header.markers} markers, {len(labels)} labels, {header.rate_hz:g} Hz"
        raise BadFile(path, found, "a label for each marker, and a rate", FETCH_AGAIN)
    points = _read_points(header, data)
    at, residual = points[..., :3], points[..., 3]
    reported = (residual >= 0.0) & np.all(np.abs(at) < MAX_VALUE, axis=2)
    empty = reported & np.all(at == 0.0, axis=2) & (np.floor(residual) % _RESIDUALS == 0.0)
    seen = reported & ~empty
    notes = (
        (f"{empty.sum()} positions at exactly (0, 0, 0) count as markers that were not seen.",) if empty.any() else ()
    )
    position: Floats = np.where(seen[..., None], at, np.nan)
    names = tuple(label.split(":")[-1] for label in labels)
    return MarkerClip(
        name=path.stem,
        subject=path.stem.split("_", 1)[0],
        labels=names if len(set(names)) == len(names) else tuple(labels),
        rate_hz=header.rate_hz,
        position_m=position * unit @ _WORLD_FROM_FILE[screen].T,
        unit_m=unit,
        unit_evidence=unit_evidence,
        up_evidence=f"{screen[1].removeprefix('+').lower()} (POINT:Y_SCREEN is {screen[1]})",
        notes=notes,
    )


def _read_points(header: C3dHeader, data: bytes) -> Floats:
    """(T, M, 4) positions in the file's unit, and a number that is below zero where a marker was not seen.

    Of the frames that may be padding, those at the end without any value are left out.
    """
    frames = count_frames(header, len(data))
    block = memoryview(data)[header.data_start : header.data_start + frames[-1] * header.frame_bytes]
    code = "f4" if header.value_bytes == 4 else "i2"
    values = header.decode(block, code).reshape(frames[-1], -1)
    written = np.flatnonzero(values[frames[0] :].any(axis=1))
    count = frames[0] + (int(written[-1]) + 1 if len(written) else 0)
    with np.errstate(invalid="ignore"):
        points: Floats = values[:count, : 4 * header.markers].astype(np.float64).reshape(count, header.markers, 4)
    if code == "i2":
        points[..., :3] *= header.scale
    return points


def _label_keys(header: C3dHeader) -> list[str]:
    """LABELS, LABELS2, LABELS3, ..., which hold 255 labels each."""
    digits = {key: key.removeprefix("POINT:LABELS") for key in header.parameters if key.startswith("POINT:LABELS")}
    return sorted(
        (key for key, tail in digits.items() if not tail or tail.isdecimal()), key=lambda key: int(digits[key] or 1)
    )


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


def _length_unit(path: Path, units: tuple[str, ...], given_m: float | None) -> tuple[float, str]:
    """Unit of length [m] and the evidence; BadFile if neither the file nor the caller gives one."""
    if given_m is not None:
        return given_m, "unit as given"
    name = find_unit(units[0], LENGTH_UNITS_M) if units else ""
    if not name:
        found = f"POINT:UNITS {units[0]!r}" if units else "no POINT:UNITS"
        raise BadFile(path, found, f"one of {', '.join(LENGTH_UNITS_M)}", "Name the unit with --unit.")
    return LENGTH_UNITS_M[name], f"{units[0]}, from POINT:UNITS"
