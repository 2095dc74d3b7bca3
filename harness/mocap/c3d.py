"""C3D files: positions of markers, read by ezc3d (extra `c3d`), in world axes and metres.

The header is checked first, because ezc3d trusts it. Unit and axes come from the file's own parameters
(POINT:UNITS, POINT:X_SCREEN and Y_SCREEN; https://www.c3d.org/HTML/Documents/parameterslist.htm): in CMU's files
millimetres, x across the screen and z up, which are the world's x and z.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.arrays import Floats, freeze
from harness.core.motion import Clip
from harness.core.skeleton import forward
from harness.errors import BadFile, MissingExtra
from harness.mocap.c3d_header import check_header
from harness.mocap.files import check_size

UNITS_M = {"mm": 0.001, "cm": 0.01, "m": 1.0, "in": 0.0254}

_WHAT = "a C3D marker file"
_AGAIN = "Fetch or export it again."
_WORLD_FROM_FILE = {
    ("+X", "+Z"): np.eye(3),
    ("+Y", "+Z"): np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]),
    ("+X", "+Y"): np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
}
"""By the axes across and up the screen."""


@dataclass(frozen=True, eq=False)
class MarkerClip:
    """T frames of M markers in world axes (z up)."""

    name: str
    subject: str
    labels: tuple[str, ...]
    """Without the subject's prefix ("LFHD")."""
    rate_hz: float
    position_m: Floats
    """(T, M, 3) NaN where a marker was not seen [m]."""
    unit_m: float
    evidence: str
    """Why the unit and the axes are what they are."""

    def __post_init__(self) -> None:
        freeze(self, position_m=("T", len(self.labels), 3))

    def __len__(self) -> int:
        return len(self.position_m)


def read_c3d(path: Path | str, *, unit_m: float | None = None) -> MarkerClip:
    """The markers of a C3D file; BadFile for what is none, or has no unit or axes; MissingExtra without ezc3d."""
    path = Path(path)
    check_size(path, _WHAT)
    check_header(path)
    try:
        import ezc3d
    except ImportError as error:
        raise MissingExtra("Reading C3D files", "ezc3d", "c3d") from error
    try:
        content = ezc3d.c3d(str(path))
    except (OSError, RuntimeError, ValueError, IndexError, KeyError) as error:
        raise BadFile(path, f"a file that ezc3d cannot read ({error})", _WHAT, _AGAIN) from error
    point = content["parameters"]["POINT"]
    unit, unit_evidence = _unit(path, _texts(point, "UNITS"), unit_m)
    screen = tuple((_texts(point, key) or [""])[0] for key in ("X_SCREEN", "Y_SCREEN"))
    if screen not in _WORLD_FROM_FILE:
        found = f"POINT:X_SCREEN {screen[0]!r} and Y_SCREEN {screen[1]!r}"
        known = " or ".join(f"{across} and {up}" for across, up in _WORLD_FROM_FILE)
        raise BadFile(path, found, f"{known}, which say where up is", "Set them in the program that wrote it.")
    points = np.asarray(content["data"]["points"], dtype=float)[:3]
    seen = np.asarray(content["data"]["meta_points"]["residuals"], dtype=float)[0] >= 0.0
    seen &= np.all(np.isfinite(points), axis=0)
    labels = [
        label for key in sorted(point, key=_label_order) if key.startswith("LABELS") for label in _texts(point, key)
    ]
    if points.shape[1] != len(labels) or points.shape[2] == 0:
        found = f"{points.shape[1]} markers, {len(labels)} labels and {points.shape[2]} frames"
        raise BadFile(path, found, "a label for each marker, and frames", _AGAIN)
    position: Floats = np.where(seen[..., None], np.moveaxis(points, 0, -1), np.nan)
    return MarkerClip(
        name=path.stem,
        subject=path.stem.split("_", 1)[0],
        labels=tuple(label.split(":")[-1] for label in labels),
        rate_hz=float(content["header"]["points"]["frame_rate"]),
        position_m=np.moveaxis(position, 0, 1) * unit @ _WORLD_FROM_FILE[screen].T,
        unit_m=unit,
        evidence=f"{unit_evidence}; {screen[1]} is up, from POINT:Y_SCREEN",
    )


@dataclass(frozen=True)
class MarkerSpread:
    """How firmly a marker sits on the bone that it follows best."""

    label: str
    bone: str
    spread_m: float
    """Standard deviation of its place in the bone's frame, over all three axes [m]."""


def marker_spreads(markers: MarkerClip, clip: Clip) -> tuple[MarkerSpread, ...]:
    """Each marker's bone, found by the least spread, in a clip of the same take (frame by frame).

    Markers seen in fewer than two frames are left out.
    """
    frames = min(len(markers), len(clip))
    pose = forward(clip.skeleton, clip.root_m[:frames], clip.world_from_root[:frames], clip.angles_rad[:frames])
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


def _unit(path: Path, units: list[str], given_m: float | None) -> tuple[float, str]:
    """The unit of length [m] and its evidence; BadFile if the file names none and none is given."""
    if given_m is not None:
        return given_m, "unit as given"
    if not units or units[0].lower() not in UNITS_M:
        found = f"POINT:UNITS {units[0]!r}" if units else "no POINT:UNITS"
        raise BadFile(path, found, f"one of {', '.join(UNITS_M)}", "Give the unit's length in metres (--unit).")
    return UNITS_M[units[0].lower()], f"{units[0]}, from POINT:UNITS"


def _texts(group: Any, key: str) -> list[str]:
    """A text parameter, stripped; [] if there is none."""
    value = group[key]["value"] if key in group else []
    return [text.strip() for text in value if isinstance(text, str)]


def _label_order(key: str) -> int:
    """LABELS, LABELS2, LABELS3, ...: 255 labels fit in each."""
    digits = key.removeprefix("LABELS")
    return int(digits) if digits.isdigit() else 1
