"""Poses of clusters of markers in a C3D file: `head_1`, `head_2`, `head_3` are a body `head`."""

from pathlib import Path

import numpy as np

from harness.errors import BadFile
from harness.mocap import read_c3d
from harness.stream import BodyPoses, FileFinding, PoseLog
from harness.study.trust.truth_files import FEWEST_MARKERS, body_of_label, fit_rigid_body


def read_marker_poses(path: Path, unit_m: float | None = None) -> PoseLog:
    """Fit a rigid body to each cluster of three or more markers. Raises BadFile for a file without such clusters."""
    markers = read_c3d(path, unit_m=unit_m)
    rows: dict[str, list[int]] = {}
    for row, label in enumerate(markers.labels):
        rows.setdefault(body_of_label(label), []).append(row)
    clusters = {name: found for name, found in rows.items() if name and len(found) >= FEWEST_MARKERS}
    if not clusters:
        found = f"no three markers of one body among {', '.join(markers.labels[:12])}"
        raise BadFile(path, found, "three or more for each body", "Label them NAME_1, NAME_2, NAME_3.")
    times_s = np.arange(len(markers)) / markers.rate_hz
    poses, findings = {}, []
    for name, columns in clusters.items():
        position_m, quaternion, residual_m = fit_rigid_body(path, name, markers.position_m[:, columns])
        seen = np.isfinite(position_m).all(axis=1)
        poses[name] = times_s[seen], position_m[seen], quaternion[seen]
        value = f"{len(columns)} markers that fit a rigid body to {1e3 * residual_m:.2g} mm (RMS)"
        findings.append(FileFinding(f"body {name}", value, "their labels"))
    findings.append(FileFinding("rate", f"{markers.rate_hz:g} Hz", "the file's header"))
    findings.append(FileFinding("length unit", f"{markers.unit_m:g} m", markers.unit_evidence))
    findings.append(FileFinding("up", "z", markers.up_evidence))
    start_s = min(float(times[0]) for times, _, _ in poses.values())
    bodies = tuple(BodyPoses(name, times - start_s, *rest) for name, (times, *rest) in poses.items())
    return PoseLog(bodies, path.name, tuple(findings), f"frames counted at {markers.rate_hz:g} Hz")
