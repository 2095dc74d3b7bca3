"""Poses of clusters of markers in a C3D file: `head_1`, `head_2`, `head_3` are a body `head`.

A label is the name of a body, a separator (`_`, `-`, `.` or none) and a number or a letter: `head_1`, `head1`,
`HEAD-A`. Capital and small letters are the same.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.errors import BadFile, BadInput
from harness.mocap import MarkerClip, read_c3d
from harness.stream import BodyPoses, FileFinding, PoseFileOptions, PoseLog

MARKER_SUFFIX = ".c3d"
_FEWEST_MARKERS = 3
_LABEL_END = re.compile(r"[\s_.\-:]*(?:\d+|[A-Za-z])$")
_MOST_RESIDUAL_M = 0.02
"""Largest RMS residual of the markers of a rigid body [m] [choice]."""
_LEAST_SPREAD_M = 0.005
"""Least distance of the markers of a body from their common line [m]."""


@dataclass(frozen=True, eq=False)
class MarkerPoses:
    """Poses of the bodies of markers, and the noise that the markers show."""

    log: PoseLog
    noise: Mapping[str, tuple[float, float]]
    """Body -> standard deviations of its positions [m] and rotations [rad] on each axis."""


def read_marker_poses(path: Path, options: PoseFileOptions) -> MarkerPoses:
    """Fit the clusters of a C3D file. Raises BadFile as `fit_markers`, and BadInput for options of text files."""
    if options != PoseFileOptions(unit_m=options.unit_m, untimed=options.untimed):
        raise BadInput(f"Options of text files for {path.name}.", "A C3D file takes the unit alone.")
    return fit_markers(path, read_c3d(path, unit_m=options.unit_m))


def fit_markers(path: Path, markers: MarkerClip) -> MarkerPoses:
    """Fit a rigid body to each cluster of three or more markers: the mean shape that fits best in each frame.

    Raises BadFile for a file without such clusters, for markers on one line and for those of no rigid body.
    """
    rows: dict[str, list[int]] = {}
    for row, label in enumerate(markers.labels):
        rows.setdefault(body_of_label(label), []).append(row)
    clusters = {name: found for name, found in rows.items() if name and len(found) >= _FEWEST_MARKERS}
    if not clusters:
        found = f"no three markers of one body among {', '.join(markers.labels[:12])}"
        raise BadFile(path, found, "three or more for each body", "Label them NAME_1, NAME_2, NAME_3.")
    times_s = np.arange(len(markers)) / markers.rate_hz
    poses, noise, findings = {}, {}, list[FileFinding]()
    for name, columns in clusters.items():
        position_m, quaternion, residual_m = fit_rigid_body(path, name, markers.position_m[:, columns])
        if residual_m > _MOST_RESIDUAL_M:
            found = f"markers of {name!r} that fit a rigid body to {1e3 * residual_m:.0f} mm (RMS) only"
            advice = "Are labels exchanged or twice, or are markers on different bodies?"
            raise BadFile(path, found, f"{1e3 * _MOST_RESIDUAL_M:g} mm at most", advice)
        seen = np.isfinite(position_m).all(axis=1)
        poses[name] = times_s[seen], position_m[seen], quaternion[seen]
        noise[name] = _marker_noise(markers.position_m[:, columns], residual_m)
        value = f"{len(columns)} markers that fit a rigid body to {1e3 * residual_m:.2g} mm (RMS)"
        findings.append(FileFinding(f"body {name}", value, "their labels"))
    if few := [markers.labels[row] for name, found in rows.items() if name not in clusters for row in found]:
        findings.append(FileFinding("left out", ", ".join(few[:12]), "a body needs three markers"))
    findings.append(FileFinding("rate", f"{markers.rate_hz:g} Hz", "the file's header"))
    findings.append(FileFinding("length unit", f"{markers.unit_m:g} m", markers.unit_evidence))
    findings.append(FileFinding("up", "z", markers.up_evidence))
    findings += [FileFinding("left out", note.rstrip("."), "nothing was seen there") for note in markers.notes]
    start_s = min(float(times[0]) for times, _, _ in poses.values())
    bodies = tuple(BodyPoses(name, times - start_s, *rest) for name, (times, *rest) in poses.items())
    clock = f"frames counted at {markers.rate_hz:g} Hz"
    return MarkerPoses(PoseLog(bodies, path.name, tuple(findings), clock), noise)


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
        if (
            seen.sum() < _FEWEST_MARKERS
            or np.linalg.svd(shape[seen] - shape[seen].mean(axis=0))[1][1] < _LEAST_SPREAD_M
        ):
            continue
        middle, centre = points_m[seen].mean(axis=0), shape[seen].mean(axis=0)
        matrix = rotations.nearest_rotation((points_m[seen] - middle).T @ (shape[seen] - centre))
        place[frame], turn[frame] = middle - matrix @ centre, rotations.from_matrix(matrix)
        squared += float(np.sum((points_m[seen] - place[frame] - shape[seen] @ matrix.T) ** 2))
        count += int(seen.sum())
    return place, rotations.continuous(turn), float(np.sqrt(squared / max(count, 1)))


def body_of_label(label: str) -> str:
    """The name of the body that a marker's label names, in small letters: "head" of `HEAD-A`."""
    return _LABEL_END.sub("", label.strip()).lower()
