"""Poses in the units of a file as a log: clock, order of quaternions, unit of length and axis that points up.

What the file does not say is concluded from its numbers, or assumed, and stands in the findings of the log.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from harness.core import rotations
from harness.core.arrays import Floats
from harness.core.number_format import count_noun
from harness.core.units import TIME_UNITS_S
from harness.errors import BadFile, BadInput
from harness.stream.poses.columns import MILLIMETRE_PROGRAMS, TableColumns
from harness.stream.poses.evidence import (
    UNIX_S,
    conclude_length_unit,
    conclude_quaternion_order,
    conclude_resolution,
    conclude_time_unit,
    counts_samples,
)
from harness.stream.poses.number_table import EXPECTED_FILE
from harness.stream.poses.options import PoseFileOptions
from harness.stream.poses.pose_log import COUNTED, BodyPoses, FileFinding, PoseLog
from harness.stream.poses.raw_poses import RawPoses, select_poses, sort_rows

_UP_TO_Z = {
    "z": (1.0, 0.0, 0.0, 0.0),
    "y": (0.5**0.5, 0.5**0.5, 0.0, 0.0),
    "x": (0.5**0.5, 0.0, -(0.5**0.5), 0.0),
    "-z": (0.0, 1.0, 0.0, 0.0),
    "-y": (0.5**0.5, -(0.5**0.5), 0.0, 0.0),
    "-x": (0.5**0.5, 0.0, 0.5**0.5, 0.0),
}
"""Axis that points up -> quaternion that turns it to z."""
_LONGEST_S = 1e10
"""Longest log: three centuries [s] [choice]."""
UNTIMED = "numbers of samples"
"""Clock of a log whose source has no times, where no rate was given either."""
_DATED = FileFinding("time unit", "s", "dates or times of day; UTC without a zone")


class UnknownRate(BadInput):
    """A file of poses without times, for which the caller gave no rate."""

    def __init__(self, what: str, advice: str = "Give its samples per second: --rate HZ.") -> None:
        super().__init__(what, advice)


def convert_poses(
    path: Path,
    options: PoseFileOptions,
    columns: TableColumns,
    raw: list[RawPoses],
    findings: list[FileFinding],
    *,
    counted: bool,
    cut: bool,
) -> PoseLog:
    """The log of raw poses, which are used up; `findings` are those so far.

    Rows without a pose and doubled ones are left out. `counted`: the times are numbers of samples. `cut`: the file ends
    within a line.
    """
    if len(raw) > 1:
        names = ", ".join(one.name for one in raw[:12])
        findings.append(FileFinding("bodies", f"{len(raw)}: {names}", "the columns' or rows' names"))
    scale_s, clock = _conclude_clock(path, options, columns, raw, findings, counted=counted)
    for n, one in enumerate(raw):  # one after another, for memory
        timed = replace(one, times=one.times * scale_s)
        raw[n] = sort_rows(select_poses(path, timed, findings, cut=cut), findings)
    raw = [one for one in raw if len(one.times)]
    if not raw:
        raise BadFile(path, "no row with a time and a pose", EXPECTED_FILE, "Is it the right file?")
    largest = max(raw, key=lambda one: len(one.times))
    order = _conclude_order(options, columns, largest, findings, usual="wxyz" if scale_s == 1e-9 else "xyzw")
    program = columns.program
    stated_by = f"{program} writes mm" if program in MILLIMETRE_PROGRAMS else "the file's header"
    unit, unit_m = conclude_length_unit(
        largest.positions,
        None if clock == UNTIMED else largest.times,
        columns.length_unit,
        options.unit_m,
        reason=stated_by,
    )
    findings.append(unit)
    turn = _conclude_up(options, columns, findings)
    start_s = min(float(one.times[0]) for one in raw)
    bodies = []
    while raw:
        bodies.append(_to_body(raw.pop(0), order, unit_m, turn, start_s))
    unix = clock == "Unix time"
    return PoseLog(tuple(bodies), path.name, tuple(findings), clock, start_s if unix else None, start_s)


def _conclude_clock(
    path: Path,
    options: PoseFileOptions,
    columns: TableColumns,
    raw: Sequence[RawPoses],
    findings: list[FileFinding],
    *,
    counted: bool,
) -> tuple[float, str]:
    """Seconds of 1 in the column of times, and what they count. UnknownRate without either."""
    times = np.unique(np.concatenate([one.times for one in raw]))
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
            rows = sum(len(one.times) for one in raw)
            raise UnknownRate(f"{path.name} has {what} ({count_noun(rows, 'sample')}).")
        reason = "given by --rate" if options.rate_hz else "the file's header"
        findings.append(FileFinding("time", f"{COUNTED} {rate_hz:g} Hz", f"{reason}; the file has {what}"))
        return 1.0 / rate_hz, f"samples {COUNTED} {rate_hz:g} Hz"
    if options.rate_hz is not None:
        raise BadInput(f"{path.name} has times of its own.", "Leave out --rate.")
    if columns.dated and options.time_unit is not None:
        raise BadInput(f"--time-unit, but {path.name} has times of day.", "Leave it out.")
    unit = _DATED if columns.dated else conclude_time_unit(times, columns.time_unit, options.time_unit)
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


def _conclude_order(
    options: PoseFileOptions, columns: TableColumns, raw: RawPoses, findings: list[FileFinding], usual: str
) -> list[int]:
    """Places of w, x, y, z in the file's quaternions; `usual` is EuRoC's order for times in ns."""
    if len(columns.bodies[0].rotation) != 4:  # matrices or angles
        return [0, 1, 2, 3]
    finding = conclude_quaternion_order(
        raw.positions,
        raw.quaternions,
        raw.times,
        stated=columns.order,
        reason=columns.order_reason,
        given=options.quaternion,
        usual=usual,
    )
    findings.append(finding)
    return [finding.value.index(axis) for axis in "wxyz"]


def _conclude_up(options: PoseFileOptions, columns: TableColumns, findings: list[FileFinding]) -> Floats:
    """The rotation that turns the file's world to z up."""
    is_optitrack = columns.program == "OptiTrack"
    up = options.up or ("y" if is_optitrack else "z")
    usual = "the default of OptiTrack's program" if is_optitrack else "poses do not show it"
    turned = "" if up == "z" else ", turned to z"
    findings.append(
        FileFinding("up", up + turned, "given by --up" if options.up else usual, assumed=options.up is None)
    )
    findings.append(FileFinding("handedness", "right", "poses do not show it", assumed=True))
    return np.array(_UP_TO_Z[up])


def _to_body(raw: RawPoses, order: Sequence[int], unit_m: float, turn: Floats, start_s: float) -> BodyPoses:
    positions, quaternions = raw.positions * unit_m, raw.quaternions[:, order]
    if turn[0] != 1.0:
        positions, quaternions = rotations.rotate(turn, positions), rotations.multiply(turn, quaternions)
    return BodyPoses(raw.name, raw.times - start_s, positions, quaternions)
