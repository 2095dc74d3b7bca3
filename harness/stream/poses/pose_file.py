"""Reader of pose files of other programs: TUM, EuRoC, CSV of many kinds, logs of DTrack, and matrices."""

import functools
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.core.units import ANGLE_UNITS_RAD
from harness.errors import BadFile, BadInput
from harness.stream.poses.clock_text import DAY_S
from harness.stream.poses.column_groups import BodyColumns
from harness.stream.poses.column_names import AXES
from harness.stream.poses.columns import TableColumns, find_columns
from harness.stream.poses.evidence import conclude_angle_unit
from harness.stream.poses.matrices import convert_matrices, holds_matrices, split_matrices
from harness.stream.poses.number_table import NumberTable, TableHead, read_head, read_rows
from harness.stream.poses.options import PoseFileOptions
from harness.stream.poses.pose_conversion import convert_poses
from harness.stream.poses.pose_log import FileFinding, PoseLog
from harness.stream.poses.raw_poses import RawPoses


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
    columns = find_columns(head, options.columns, angles=options.euler is not None)
    if options.euler and len(columns.bodies[0].rotation) != len(AXES):
        raise BadInput(f"--euler, but {path.name} has no angles alone.", "Leave it out.")
    clock = [c for c in (columns.time, columns.nanoseconds) if c is not None]
    clock = clock or [c for c in (columns.frame,) if c is not None]
    needed = [c for body in columns.bodies for c in (*body.position, *body.rotation, *body.valid)]
    read = list(dict.fromkeys((*clock, *needed)))
    table = read_rows(head, read, columns.body)
    kind = f"{columns.program} file, " if columns.program else ""
    findings = [FileFinding("kind", f"{kind}rows of numbers, {head.form}", "the file's lines"), *columns.findings]
    if table.left_out:
        findings.append(FileFinding("left out", ", ".join(table.left_out), "they are no rows"))
    place = {c: n for n, c in enumerate(read)}
    angle_unit = _angle_unit(table, columns, place, options, findings) if options.euler else 1.0
    times = _times(table.numbers[:, : len(clock)], dated=columns.dated)
    raw = []
    for name, body, rows in _split_bodies(path, columns, table):
        numbers, own_times = (table.numbers, times) if rows is None else (table.numbers[rows], times[rows])
        tracked = (numbers[:, [place[c] for c in body.valid]] != 0.0).all(axis=1)
        if lost := int(np.count_nonzero(~tracked)):
            reason = "a column says that they are not valid"
            findings.append(FileFinding(f"untracked rows of {name}", f"{lost} of {len(tracked)} left out", reason))
            numbers, own_times = numbers[tracked], own_times[tracked]
        turns = numbers[:, [place[c] for c in body.rotation]]
        quaternions = _quaternions(path, turns, angle_unit, (options.euler or "")[: len(AXES)])
        raw.append(RawPoses(name, own_times, numbers[:, [place[c] for c in body.position]], quaternions))
        del numbers, own_times
    if not any(len(one.times) for one in raw):
        raise BadFile(path, "no row that its column of validity calls tracked", "poses", "Name the columns: --columns.")
    ends_whole = table.ends_whole
    del table, times
    return convert_poses(path, options, columns, raw, findings, counted=columns.time is None, cut=not ends_whole)


def _times(clock: Floats, *, dated: bool) -> Floats:
    """Times (N,) of columns of times and nanoseconds (N, up to 2); numbers of rows without such columns.

    Times of day go on after midnight.
    """
    if not clock.shape[1]:
        return np.arange(len(clock), dtype=np.float64)
    times = clock[:, 0] + (1e-9 * clock[:, 1] if clock.shape[1] > 1 else 0.0)
    finite = np.isfinite(times)
    if dated and times[finite].max(initial=0.0) <= DAY_S:
        times[finite] = np.unwrap(times[finite], period=DAY_S)
    return times


def _split_bodies(
    path: Path, columns: TableColumns, table: NumberTable
) -> Iterator[tuple[str, BodyColumns, Ints | None]]:
    """Name, columns and rows of each body; None for all rows."""
    names = _body_names(path, columns, table.names)
    if columns.body is None:
        yield from zip(names, columns.bodies, [None] * len(names), strict=True)
        return
    for code, name in enumerate(names):
        if len(rows := np.flatnonzero(table.name_of == code)):
            yield name, columns.bodies[0], rows


def _angle_unit(
    table: NumberTable,
    columns: TableColumns,
    place: dict[int, int],
    options: PoseFileOptions,
    findings: list[FileFinding],
) -> float:
    """Radians of 1 in the columns of angles."""
    angles = table.numbers[:, [place[c] for body in columns.bodies for c in body.rotation]]
    unit = conclude_angle_unit(angles, columns.angle_unit, options.angle_unit)
    findings += [FileFinding("axes of the angles", (options.euler or "")[:3], "given by --euler"), unit]
    return ANGLE_UNITS_RAD[unit.value]


def _quaternions(path: Path, turns: Floats, angle_unit: float, euler: str) -> Floats:
    """Quaternions (N, 4) of matrices (N, 9), column by column, or angles (N, 3), w first; others (N, 4) stay."""
    if turns.shape[1] == 9:
        return convert_matrices(path, turns.reshape(-1, 3, 3).transpose(0, 2, 1))
    if turns.shape[1] == len(AXES):
        with np.errstate(over="ignore", invalid="ignore"):
            about = [rotations.exp(angle_unit * turns[:, n, None] * np.eye(3)[n]) for n in map(AXES.index, euler)]
            return functools.reduce(rotations.multiply, about)
    return turns


def _read_matrices(head: TableHead, options: PoseFileOptions) -> PoseLog:
    if options.euler:
        raise BadInput(f"--euler, but {head.path.name} has no angles alone.", "Leave it out.")
    table = read_rows(head, range(head.columns))
    times, positions, quaternions, left_out = split_matrices(head, table.numbers)
    kind = f"{len(positions)} matrices"
    findings = [FileFinding("kind", kind, f"{head.form}, with axes of length 1 at right angles")]
    if left_out or table.left_out:
        findings.append(FileFinding("left out", ", ".join(filter(None, (left_out, *table.left_out))), "incomplete"))
    counted = np.arange(len(positions), dtype=np.float64)
    raw = [RawPoses(head.path.stem, counted if times is None else times, positions, quaternions)]
    body = BodyColumns("", (0, 1, 2), tuple(range(3, 12)))
    columns = TableColumns((body,), None if times is None else 0, None, None, dated=0 in head.word_columns)
    return convert_poses(head.path, options, columns, raw, findings, counted=times is None, cut=False)


def _body_names(path: Path, columns: TableColumns, words: tuple[str, ...]) -> list[str]:
    """Names of the bodies, each another."""
    if columns.body is not None:
        return [re.sub(r"^(\d+)\.0*$", r"\1", word) or path.stem for word in words]
    names = [body.name for body in columns.bodies]
    if names == [""]:
        return [path.stem]
    numbered = [name or f"body{n}" for n, name in enumerate(names, 1)]
    return [name if numbered.count(name) == 1 else f"{name}_{n}" for n, name in enumerate(numbered, 1)]
