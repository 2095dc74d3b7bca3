"""Reader of pose files of other programs: TUM, EuRoC, CSV of many kinds, and matrices.

Everything that the file does not say is concluded from its numbers, or assumed, and stands in the findings of the log.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints
from harness.core.number_format import count_noun, format_share
from harness.core.units import TIME_UNITS_S
from harness.errors import BadFile, BadInput
from harness.stream.poses.columns import NORM_TOLERANCE, BodyColumns, TableColumns, find_columns
from harness.stream.poses.evidence import (
    UNIX_S,
    conclude_length_unit,
    conclude_quaternion_order,
    conclude_resolution,
    conclude_time_unit,
    counts_samples,
)
from harness.stream.poses.matrices import holds_matrices, split_matrices
from harness.stream.poses.number_table import EXPECTED_FILE, TableHead, read_head, read_rows
from harness.stream.poses.options import PoseFileOptions
from harness.stream.poses.pose_log import COUNTED, BodyPoses, FileFinding, PoseLog

_UP_TO_Z = {
    "z": (1.0, 0.0, 0.0, 0.0),
    "y": (0.5**0.5, 0.5**0.5, 0.0, 0.0),
    "x": (0.5**0.5, 0.0, -(0.5**0.5), 0.0),
    "-z": (0.0, 1.0, 0.0, 0.0),
    "-y": (0.5**0.5, -(0.5**0.5), 0.0, 0.0),
    "-x": (0.5**0.5, 0.0, 0.5**0.5, 0.0),
}
"""Axis that points up -> quaternion that turns it to z."""
_LOST_SHARE = 0.05
"""Distance from (0, 0, 0) of the poses before and after, in median distances, from which on positions that are exactly
there count as not seen [choice]."""
_CUT_NORMS, _EXACT_NORM = 3.0, 1e-8
"""Deviations of a norm from 1 that show a row to be cut: in those of the other rows, and above that of exact ones."""
_FARTHEST, _LONGEST_S = 1e9, 1e10
"""Largest coordinate, in the file's unit, and longest log: three centuries [s] [choices]."""
UNTIMED = "numbers of samples"
"""Clock of a log whose source has no times, where no rate was given either."""


class UnknownRate(BadInput):
    """A file of poses without times, for which the caller gave no rate."""

    def __init__(self, what: str, advice: str = "Give its samples per second: --rate HZ.") -> None:
        super().__init__(what, advice)


@dataclass(frozen=True, eq=False)
class _RawPoses:
    """Rows of one body as they stand in the file, times in seconds on the file's clock."""

    name: str
    times_s: Floats
    positions: Floats
    quaternions: Floats


def read_pose_log(paths: Path | str | Sequence[Path | str], options: PoseFileOptions | None = None) -> PoseLog:
    """Read the bodies of one file, or of several files on one clock.

    Raises BadFile for a file that holds no poses, UnknownRate for one without times, and BadInput for files that cannot
    be of one clock.
    """
    options = options or PoseFileOptions()
    several = [paths] if isinstance(paths, Path | str) else list(paths)
    logs = [_read_file(Path(path), options) for path in several]
    return logs[0] if len(logs) == 1 else _join([Path(path).stem for path in several], logs)


def _join(stems: Sequence[str], logs: Sequence[PoseLog]) -> PoseLog:
    """Logs of several files as one."""
    if len({log.start_unix_s is None for log in logs}) > 1:
        raise BadInput("Files with Unix times, and others without.", "Their clocks cannot be related: read them alone.")
    begins, ends = [log.start_s for log in logs], [log.start_s + log.duration_s for log in logs]
    shared = "their times overlap" if max(begins) < min(ends) else "each begins at its first time: they do not overlap"
    if logs[0].start_unix_s is not None:
        shared = "Unix times"
    elif max(begins) >= min(ends):
        begins = [0.0] * len(logs)
    first_s = min(begins)
    bodies = []
    for stem, log, begin_s in zip(stems, logs, begins, strict=True):
        for body in log.bodies:
            name = stem if len(log.bodies) == 1 else f"{stem}.{body.name}"
            bodies.append(replace(body, name=name, times_s=body.times_s + (begin_s - first_s)))
    findings = [
        FileFinding(f"{stem}: {finding.subject}", finding.value, finding.reason, finding.assumed)
        for stem, log in zip(stems, logs, strict=True)
        for finding in log.findings
    ]
    findings.append(FileFinding("common clock", "one for all files", shared, assumed=True))
    source = ", ".join(log.source for log in logs)
    start_unix_s = None if logs[0].start_unix_s is None else first_s
    return PoseLog(tuple(bodies), source, tuple(findings), logs[0].clock, start_unix_s, first_s)


def _read_file(path: Path, options: PoseFileOptions) -> PoseLog:
    head = read_head(path)
    if options.columns is None and holds_matrices(head):
        return _read_matrices(head, options)
    columns = find_columns(head, options.columns)
    needed = [c for body in columns.bodies for c in (*body.position, *body.quaternion)]
    clock = [c for c in (columns.time, columns.nanoseconds) if c is not None]
    clock = clock or [c for c in (columns.frame,) if c is not None]
    table = read_rows(head, [*clock, *needed], columns.body)
    counted = np.arange(len(table.numbers), dtype=np.float64)
    times, poses = counted if not clock else table.numbers[:, 0], table.numbers[:, len(clock) :]
    if len(clock) > 1:
        times = times + 1e-9 * table.numbers[:, 1]
    findings = [FileFinding("kind", f"rows of numbers, {head.form}", "the file's lines"), *columns.findings]
    if table.left_out:
        findings.append(FileFinding("left out", ", ".join(table.left_out), "they are no rows"))
    names = _body_names(path, columns, table.names)
    if columns.body is not None:
        raw = [
            _RawPoses(name, times[rows], poses[rows, :3], poses[rows, 3:])
            for code, name in enumerate(names)
            if len(rows := np.flatnonzero(table.name_of == code))
        ]
    else:
        width = range(0, poses.shape[1], 7)
        raw = [
            _RawPoses(n, times, poses[:, c : c + 3], poses[:, c + 3 : c + 7]) for n, c in zip(names, width, strict=True)
        ]
    ends_whole = table.ends_whole
    del table, times, poses, counted
    return _finish(head, options, columns, raw, findings, counted=columns.time is None, cut=not ends_whole)


def _read_matrices(head: TableHead, options: PoseFileOptions) -> PoseLog:
    table = read_rows(head, range(head.columns))
    times, positions, quaternions, left_out = split_matrices(head, table.numbers)
    kind = f"{len(positions)} matrices"
    findings = [FileFinding("kind", kind, f"{head.form}, with axes of length 1 at right angles")]
    if left_out or table.left_out:
        findings.append(FileFinding("left out", ", ".join(filter(None, (left_out, *table.left_out))), "incomplete"))
    counted = np.arange(len(positions), dtype=np.float64)
    raw = [_RawPoses(head.path.stem, counted if times is None else times, positions, quaternions)]
    body = BodyColumns("", (0, 1, 2), (3, 4, 5, 6))
    columns = TableColumns((body,), None if times is None else 0, None, None, order="wxyz", order_reason="")
    return _finish(head, options, columns, raw, findings, counted=times is None, cut=False)


def _body_names(path: Path, columns: TableColumns, words: tuple[str, ...]) -> list[str]:
    """Names of the bodies, each another."""
    if columns.body is not None:
        return [f"{float(word):g}" if _is_number(word) else word or path.stem for word in words]
    names = [body.name for body in columns.bodies]
    if names == [""]:
        return [path.stem]
    numbered = [name or f"body{n}" for n, name in enumerate(names, 1)]
    return [name if numbered.count(name) == 1 else f"{name}_{n}" for n, name in enumerate(numbered, 1)]


def _is_number(word: str) -> bool:
    return bool(re.fullmatch(r"\d+\.?\d*", word))


def _finish(
    head: TableHead,
    options: PoseFileOptions,
    columns: TableColumns,
    raw: list[_RawPoses],
    findings: list[FileFinding],
    *,
    counted: bool,
    cut: bool,
) -> PoseLog:
    """Units, order, frame and clock; rows without a pose and doubled ones are left out."""
    path = head.path
    if len(raw) > 1:
        names = ", ".join(one.name for one in raw[:12])
        findings.append(FileFinding("bodies", f"{len(raw)}: {names}", "the columns' or rows' names"))
    scale_s, clock = _conclude_clock(path, options, columns, raw, findings, counted=counted)
    for n, one in enumerate(raw):  # one after another, for memory
        raw[n] = _in_order(_seen_rows(path, replace(one, times_s=one.times_s * scale_s), findings, cut=cut), findings)
    raw = [one for one in raw if len(one.times_s)]
    if not raw:
        raise BadFile(path, "no row with a time and a pose", EXPECTED_FILE, "Is it the right file?")
    largest = max(raw, key=lambda one: len(one.times_s))
    order = _conclude_order(options, columns, largest, findings, usual="wxyz" if scale_s == 1e-9 else "xyzw")
    unit, unit_m = conclude_length_unit(
        largest.positions, None if clock == UNTIMED else largest.times_s, columns.length_unit, options.unit_m
    )
    findings.append(unit)
    turn = _conclude_up(options, columns, findings)
    start_s = min(float(one.times_s[0]) for one in raw)
    bodies = []
    while raw:
        bodies.append(_to_body(raw.pop(0), order, unit_m, turn, start_s))
    unix = clock == "Unix time"
    return PoseLog(tuple(bodies), path.name, tuple(findings), clock, start_s if unix else None, start_s)


def _conclude_clock(
    path: Path,
    options: PoseFileOptions,
    columns: TableColumns,
    raw: Sequence[_RawPoses],
    findings: list[FileFinding],
    *,
    counted: bool,
) -> tuple[float, str]:
    """Seconds of 1 in the column of times, and what they count. UnknownRate without either."""
    times = np.unique(np.concatenate([one.times_s for one in raw]))
    times = times[np.isfinite(times)]
    if not len(times):
        raise BadFile(path, "no time that is a number", EXPECTED_FILE, "Is it the right file?")
    numbered = columns.frame is not None
    if not counted and not columns.time_unit and options.time_unit is None and counts_samples(times):
        counted = numbered = True
    if counted:
        what = "no times, but numbers of samples" if numbered else "no times"
        what += f", but text in the column {columns.text_time!r}" if columns.text_time else ""
        rate_hz = options.rate_hz or columns.rate_hz
        if options.time_unit is not None:
            raise BadInput(f"--time-unit, but {path.name} has {what}.", "Give --rate HZ instead.")
        if rate_hz is None and options.untimed:
            findings.append(FileFinding("time", "none: give the samples per second with --rate HZ", f"it has {what}"))
            return 1.0, UNTIMED
        if rate_hz is None:
            rows = sum(len(one.times_s) for one in raw)
            raise UnknownRate(f"{path.name} has {what} ({count_noun(rows, 'sample')}).")
        reason = "given by --rate" if options.rate_hz else "the file's header"
        findings.append(FileFinding("time", f"{COUNTED} {rate_hz:g} Hz", f"{reason}; the file has {what}"))
        return 1.0 / rate_hz, f"samples {COUNTED} {rate_hz:g} Hz"
    if options.rate_hz is not None:
        raise BadInput(f"{path.name} has times of its own.", "Leave out --rate.")
    unit = conclude_time_unit(times, columns.time_unit, options.time_unit)
    findings.append(unit)
    scale_s = TIME_UNITS_S[unit.value]
    with np.errstate(over="ignore"):
        length_s = scale_s * (times[-1] - times[0])
    if not length_s <= _LONGEST_S:
        raise BadFile(path, f"times that span {length_s:.3g} s", EXPECTED_FILE, "Are columns and --time-unit right?")
    if resolution := conclude_resolution(times, scale_s):
        findings.append(resolution)
    unix = UNIX_S[0] <= times[0] * scale_s <= UNIX_S[1]
    return scale_s, "Unix time" if unix else "seconds from an unknown start"


def _seen_rows(path: Path, raw: _RawPoses, findings: list[FileFinding], *, cut: bool) -> _RawPoses:
    """The rows that hold a pose. BadFile for quaternions of another norm than 1.

    With `cut` the file ends without a line end: a last row with the worst norm has lost digits.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        norm = np.sqrt(np.sum(raw.quaternions**2, axis=1))
    present = np.isfinite(raw.times_s) & np.isfinite(raw.positions).all(axis=1) & np.isfinite(norm) & (norm > 0.0)
    deviation = np.where(present, np.abs(norm - 1.0), 0.0)
    if cut and len(norm) > 1 and deviation[-1] > _CUT_NORMS * deviation[:-1].max() + _EXACT_NORM:
        present[-1] = False
    wrong = np.flatnonzero(present & (deviation > NORM_TOLERANCE))
    if len(wrong):
        found = f"a quaternion of norm {norm[wrong[0]]:.3g} in row {wrong[0] + 1} of {raw.name}"
        raise BadFile(path, found, "unit quaternions", "Name the columns with --columns, or remove damaged rows.")
    far = np.flatnonzero(present & (np.abs(raw.positions) > _FARTHEST).any(axis=1))
    if len(far):
        found = f"a position of {np.abs(raw.positions[far[0]]).max():.3g} in row {far[0] + 1} of {raw.name}"
        raise BadFile(path, found, "coordinates in a unit of length", "Are the columns right?")
    zero = present & ~raw.positions.any(axis=1)
    if zero.any() and not zero[present].all():
        present &= ~_lost_at_origin(raw.positions, present, zero)
    lost = int(len(present) - np.count_nonzero(present))
    if lost:
        reason = "empty cells, a row that was cut off, quaternions of 0, or positions that jump to (0, 0, 0)"
        findings.append(FileFinding(f"gaps of {raw.name}", f"{lost} of {len(present)} rows hold no pose", reason))
    rows = np.flatnonzero(present)
    return _RawPoses(raw.name, raw.times_s[rows], raw.positions[rows], raw.quaternions[rows] / norm[rows, None])


def _lost_at_origin(positions: Floats, present: Bools, zero: Bools) -> Bools:
    """Rows at exactly (0, 0, 0) next to which the body is elsewhere."""
    rows = np.flatnonzero(present & ~zero)
    size = np.linalg.norm(positions[rows], axis=1)
    scale = float(np.median(size))
    at = np.flatnonzero(zero)
    after = np.searchsorted(rows, at).clip(max=len(rows) - 1)
    before = (np.searchsorted(rows, at) - 1).clip(min=0)
    near = np.minimum(size[before], size[after]) < _LOST_SHARE * scale
    out: Bools = np.zeros_like(zero)
    out[at[~near]] = True
    return out


def _in_order(raw: _RawPoses, findings: list[FileFinding]) -> _RawPoses:
    """The rows in the order of time, one at each time."""
    back = int(np.count_nonzero(np.diff(raw.times_s) < 0.0))
    if back:
        share = format_share(back / len(raw.times_s), 1)
        reason = "the time is less than that of the row before; they were sorted"
        findings.append(FileFinding(f"order of {raw.name}", f"{share} of the rows are out of order", reason))
    order: Ints = np.argsort(raw.times_s, kind="stable") if back else np.arange(len(raw.times_s))
    times_s, positions, quaternions = raw.times_s[order], raw.positions[order], raw.quaternions[order]
    fresh = np.append(True, np.diff(times_s) > 0.0)
    if not fresh.all():
        first = np.flatnonzero(fresh)[np.cumsum(fresh) - 1]
        same = (positions == positions[first]).all(axis=1) & (quaternions == quaternions[first]).all(axis=1)
        doubled, others = int(np.count_nonzero(~fresh & same)), int(np.count_nonzero(~fresh & ~same))
        for count, what in ((doubled, "repeat time and pose of another"), (others, "have the time of another")):
            if count:
                value = f"{format_share(count / len(fresh), 1)} of the rows {what}"
                findings.append(FileFinding(f"doubled rows of {raw.name}", value, "the first of them was kept"))
    return _RawPoses(raw.name, times_s[fresh], positions[fresh], quaternions[fresh])


def _conclude_order(
    options: PoseFileOptions, columns: TableColumns, raw: _RawPoses, findings: list[FileFinding], usual: str
) -> list[int]:
    """Places of w, x, y, z in the file's quaternions; `usual` is EuRoC's order for times in ns."""
    if columns.order and not columns.order_reason:
        return [0, 1, 2, 3]  # matrices
    finding = conclude_quaternion_order(
        raw.positions,
        raw.quaternions,
        raw.times_s,
        stated=columns.order,
        reason=columns.order_reason,
        given=options.quaternion,
        usual=usual,
    )
    findings.append(finding)
    return [finding.value.index(axis) for axis in "wxyz"]


def _conclude_up(options: PoseFileOptions, columns: TableColumns, findings: list[FileFinding]) -> Floats:
    """The rotation that turns the file's world to z up."""
    up = options.up or ("y" if columns.motive else "z")
    usual = "the default of OptiTrack's program" if columns.motive else "poses do not show it"
    turned = "" if up == "z" else ", turned to z"
    findings.append(
        FileFinding("up", up + turned, "given by --up" if options.up else usual, assumed=options.up is None)
    )
    findings.append(FileFinding("handedness", "right", "poses do not show it", assumed=True))
    return np.array(_UP_TO_Z[up])


def _to_body(raw: _RawPoses, order: Sequence[int], unit_m: float, turn: Floats, start_s: float) -> BodyPoses:
    positions, quaternions = raw.positions * unit_m, raw.quaternions[:, order]
    if turn[0] != 1.0:
        positions, quaternions = rotations.rotate(turn, positions), rotations.multiply(turn, quaternions)
    return BodyPoses(raw.name, raw.times_s - start_s, positions, quaternions)
