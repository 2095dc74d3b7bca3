"""References from files: markers in C3D, trajectories in TUM and CSV, and motion of a skeleton.

- C3D: three or more markers for each station. A label is the station's name, a separator (`_`, `-`, `.` or none) and a
  number or a letter: `head_1`, `head1`, `HEAD-A`. Capital and small letters are the same.
- TUM: a file for each station in a folder, NAME.tum or TAKE.NAME.tum, or one file for a capture of one station. A line
  is `time x y z qx qy qz qw`; `#` begins a comment.
- CSV: columns time_s (or measured_s, as `harness replay --frames` writes it), station, x_m, y_m, z_m, qw, qx, qy, qz,
  in any order; others are ignored. Rows without a time are left out, those without a pose are gaps.

Poses at exactly (0, 0, 0) among others are gaps too, which some programs write for a body that was not seen.
"""

import csv
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.csv_text import unescape_formula
from harness.core.input_file import MEGABYTE, read_input_file
from harness.errors import BadFile, Outcome, name_file
from harness.measure import TruthPoses
from harness.mocap import MarkerClip, read_c3d
from harness.study.trust.truth_motion import TruthMotion, common_names

TRAJECTORY_SUFFIXES = (".c3d", ".tum", ".csv")
FEWEST_MARKERS = 3
MAX_TEXT_BYTES = 512 * MEGABYTE
CSV_COLUMNS = ("time_s", "station", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz")
_LONGEST_HEAD = 65536
_LABEL_END = re.compile(r"[\s_.\-:]*(?:\d+|[A-Za-z])$")
_UNIT_TOLERANCE = 1e-2
_MOST_RESIDUAL_M = 0.02
"""Largest RMS residual of the markers of a rigid body [m] [choice]."""
_LEAST_SPREAD_M = 0.005
"""Least distance of the markers of a body from their common line [m]."""


def is_foreign_table(path: Path) -> bool:
    """Whether a file is a CSV table without a column for the station, such as another program writes."""
    if path.suffix.lower() != ".csv":
        return False
    with open(path, "rb") as file:
        return b"station" not in file.readline(_LONGEST_HEAD)


def read_truth_file(path: Path, stations: Sequence[str]) -> TruthMotion:
    """Read a reference for these stations; BadFile that names the place, BadInput for bodies that it lacks."""
    suffix = path.suffix.lower()
    with name_file(path):
        if suffix == ".c3d":
            return truth_of_markers(path, read_c3d(path), stations)
        bodies = read_tum(path, stations) if path.is_dir() or suffix == ".tum" else read_csv(path)
    notes = []
    for name, body in bodies.items():
        empty = np.all(body.position_m == 0.0, axis=1)
        if 0 < empty.sum() < len(empty):
            bodies[name] = replace(body, position_m=np.where(empty[:, None], np.nan, body.position_m))
            notes.append(f"{empty.sum()} poses of {name} at exactly (0, 0, 0) count as not seen.")
    return TruthMotion(f"the trajectories of {path.name}", bodies, common_names(stations, bodies), notes=tuple(notes))


def truth_of_markers(path: Path, markers: MarkerClip, stations: Sequence[str]) -> TruthMotion:
    """Bodies of markers, one for each station: the pose of the mean shape that fits best in each frame.

    BadFile where a station has fewer than three markers, or where they lie on one line.
    """
    time_s = np.arange(len(markers)) / markers.rate_hz
    bodies, notes, noise = {}, [], {}
    for station in stations:
        rows = [row for row, label in enumerate(markers.labels) if body_of_label(label) == station.lower()]
        if len(rows) < FEWEST_MARKERS:
            found = f"{len(rows)} marker(s) of station {station!r} among {', '.join(markers.labels[:12])}"
            raise BadFile(path, found, "three or more", f"Label them {station}_1, {station}_2, {station}_3.")
        place, turn, residual_m = fit_rigid_body(path, station, markers.position_m[:, rows])
        if residual_m > _MOST_RESIDUAL_M:
            found = f"markers of {station!r} that fit a rigid body to {1e3 * residual_m:.0f} mm (RMS) only"
            advice = "Are labels exchanged or twice, or are markers on different bodies?"
            raise BadFile(path, found, f"{1e3 * _MOST_RESIDUAL_M:g} mm at most", advice)
        bodies[station] = TruthPoses(time_s, place, turn)
        noise[station] = _marker_noise(markers.position_m[:, rows], residual_m)
        notes.append(f"The {len(rows)} markers of {station} fit one rigid body to {1e3 * residual_m:.2g} mm (RMS).")
    return TruthMotion(
        f"the markers of {path.name}, {time_s[-1]:.1f} s",
        bodies,
        common_names(stations, bodies),
        noise=noise,
        notes=(*notes, *markers.notes),
    )


def _marker_noise(position_m: Floats, residual_m: float) -> tuple[float, float]:
    """Standard deviations on each axis of the position [m] and the rotation [rad] of a body of markers (T, M, 3).

    `residual_m` is the RMS distance that the fit leaves to each marker; six of 3 M numbers are fitted.
    """
    count = position_m.shape[1]
    sigma_m = residual_m / np.sqrt(3.0 - 6.0 / count)
    whole = position_m[np.isfinite(position_m[..., 0]).all(axis=1)][0]
    around = float(np.sum((whole - whole.mean(axis=0)) ** 2))
    return float(sigma_m / np.sqrt(count)), float(sigma_m / np.sqrt(2.0 / 3.0 * around))


def fit_rigid_body(path: Path, station: str, position_m: Floats) -> tuple[Floats, Floats, float]:
    """Positions (T, 3), orientations (T, 4) and RMS residual [m] of the rigid body of markers (T, M, 3).

    The shape is the mean of the frames with all markers, each turned onto the first of them; the body's axes are those
    of the world there. Each frame with three markers or more is fitted by Kabsch 1976. Others are NaN.
    """
    whole = np.flatnonzero(np.isfinite(position_m[..., 0]).all(axis=1))
    if not len(whole):
        raise BadFile(path, f"no frame with all markers of {station!r}", "one at least", "Look at the marker set.")
    shape = position_m[whole[0]] - position_m[whole[0]].mean(axis=0)
    if np.linalg.svd(shape)[1][1] < _LEAST_SPREAD_M:
        raise BadFile(path, f"markers of {station!r} on one line", "three that span a plane", "Move one of them.")
    for _ in range(2):
        turned = []
        for frame in whole[:: max(len(whole) // 200, 1)]:
            centred = position_m[frame] - position_m[frame].mean(axis=0)
            turned.append(centred @ rotations.nearest_rotation(centred.T @ shape))
        shape = np.mean(turned, axis=0)
    place, turn = np.full((len(position_m), 3), np.nan), np.full((len(position_m), 4), np.nan)
    squared, count = 0.0, 0
    for frame, points_m in enumerate(position_m):
        seen = np.isfinite(points_m[:, 0])
        if seen.sum() < FEWEST_MARKERS or np.linalg.svd(shape[seen] - shape[seen].mean(axis=0))[1][1] < _LEAST_SPREAD_M:
            continue
        middle, centre = points_m[seen].mean(axis=0), shape[seen].mean(axis=0)
        matrix = rotations.nearest_rotation((points_m[seen] - middle).T @ (shape[seen] - centre))
        place[frame], turn[frame] = middle - matrix @ centre, rotations.from_matrix(matrix)
        squared += float(np.sum((points_m[seen] - place[frame] - shape[seen] @ matrix.T) ** 2))
        count += int(seen.sum())
    return place, rotations.continuous(turn), float(np.sqrt(squared / max(count, 1)))


def read_tum(path: Path, stations: Sequence[str]) -> dict[str, TruthPoses]:
    """Trajectories of a folder with NAME.tum for each station, or of one file for one station. BadFile."""
    if not path.is_dir():
        if len(stations) != 1:
            found = f"one trajectory for {len(stations)} stations"
            raise BadFile(path, found, "a folder with NAME.tum for each station", "Name the folder.")
        return {stations[0]: _read_tum_file(path)}
    return {name: _read_tum_file(_tum_file(path, name)) for name in stations}


def _tum_file(folder: Path, station: str) -> Path:
    """The only file of a station in a folder: NAME.tum or, as `harness export` names it, TAKE.NAME.tum. BadFile."""
    found = sorted(file for file in folder.iterdir() if f".{file.name}".endswith(f".{station}.tum"))
    if len(found) != 1:
        count = "no trajectory" if not found else f"{len(found)} trajectories"
        raise BadFile(folder, f"{count} of station {station!r}", f"one file {station}.tum", "Look at the folder.")
    return found[0]


def _read_tum_file(path: Path) -> TruthPoses:
    text = _read_text(path, "a TUM trajectory: time x y z qx qy qz qw")
    rows = []
    for number, line in enumerate(text.splitlines(), 1):
        if line.strip() and not line.lstrip().startswith("#"):
            rows.append(_numbers(path, number, line.split(), 8))
    table = np.array(rows).reshape(-1, 8)
    return _poses(path, table[:, 0], table[:, 1:4], table[:, [7, 4, 5, 6]])


def read_csv(path: Path) -> dict[str, TruthPoses]:
    """Trajectories of a table with the columns `CSV_COLUMNS`, station by station. BadFile."""
    expected = f"a table with the columns {', '.join(CSV_COLUMNS)}"
    text = _read_text(path, expected)
    try:
        lines = list(csv.reader(text.splitlines()))
    except csv.Error as error:
        raise BadFile(path, f"no table ({error})", expected, "Is it the right file?") from error
    head = [name.strip() for name in lines[0]] if lines else []
    if "time_s" not in head:
        head = ["time_s" if name == "measured_s" else name for name in head]
    missing = [name for name in CSV_COLUMNS if name not in head]
    if missing:
        raise BadFile(path, f"no column {missing[0]}", expected, "`harness replay --frames` writes such a table.")
    place = [head.index(name) for name in CSV_COLUMNS]
    rows: dict[str, list[list[float]]] = {}
    if lines and lines[-1] == [Outcome.PASS.word]:
        lines.pop()  # the last line of a command's output
    for number, row in enumerate(lines[1:], 2):
        if not row:
            continue
        if len(row) < len(head) or any(row[len(head) :]):
            raise BadFile(path, f"line {number} has {len(row)} of {len(head)} values", expected, "Look at that line.")
        values = [row[column].strip() for column in place]
        if not values[0]:
            continue
        numbers = ["nan" if value == "" else value for value in (values[0], *values[2:])]
        rows.setdefault(unescape_formula(values[1]), []).append(_numbers(path, number, numbers, 8))
    bodies = {}
    for name, values_of in rows.items():
        table = np.array(values_of)
        bodies[name] = _poses(path, table[:, 0], table[:, 1:4], table[:, 4:])
    return bodies


def _read_text(path: Path, expected: str) -> str:
    data = read_input_file(path, expected, MAX_TEXT_BYTES)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise BadFile(path, "bytes that are no text", expected, "Is it the right file?") from error


def _numbers(path: Path, line: int, words: Sequence[str], count: int) -> list[float]:
    try:
        values = [float(word) for word in words]
    except ValueError:
        values = []
    if len(values) != count:
        raise BadFile(path, f"line {line} has no {count} numbers", "a trajectory", "Look at that line.")
    return values


def _poses(path: Path, time_s: Floats, position_m: Floats, quaternion: Floats) -> TruthPoses:
    """Poses in the order of time; BadFile for quaternions of another length and for times that are not numbers."""
    if not len(time_s) or not np.isfinite(time_s).all():
        raise BadFile(path, "no times, or one that is no number", "a trajectory", "Look at its first column.")
    with np.errstate(invalid="ignore", over="ignore"):
        length = np.sqrt(np.sum(quaternion**2, axis=1))
    if np.any(np.abs(length - 1.0) > _UNIT_TOLERANCE) or np.isinf(position_m).any():
        raise BadFile(
            path, "a quaternion that is not of length 1", "unit quaternions", "Is the order of columns right?"
        )
    poses = np.column_stack([position_m, quaternion / length[:, None]])
    unique_s, rows, row_of = np.unique(time_s, return_index=True, return_inverse=True)
    if not np.array_equal(poses[rows][row_of], poses, equal_nan=True):
        twice = unique_s[row_of][np.flatnonzero((poses[rows][row_of] != poses).any(axis=1))[0]]
        raise BadFile(path, f"two poses at {twice:.10g} s", "one pose at each time", "Give times with more digits.")
    return TruthPoses(unique_s, poses[rows, :3], poses[rows, 3:])


def body_of_label(label: str) -> str:
    """The name of the body that a marker's label names, in small letters: "head" of `HEAD-A`."""
    return _LABEL_END.sub("", label.strip()).lower()
