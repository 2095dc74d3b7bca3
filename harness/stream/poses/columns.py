"""Which columns of a table are time, position and rotation of which body."""

import re
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from harness.core.arrays import Floats
from harness.core.units import ANGLE_UNITS_RAD, LENGTH_UNITS_M, TIME_UNITS_S, find_unit
from harness.errors import BadFile
from harness.stream.poses.column_groups import COLUMNS_ADVICE, EXPECTED_COLUMNS, QUATERNION, BodyColumns, group_columns
from harness.stream.poses.column_names import ColumnName, parse_column_name
from harness.stream.poses.number_table import TableHead
from harness.stream.poses.pose_log import FileFinding

NORM_TOLERANCE = 0.01
"""Largest deviation of a quaternion's norm from 1."""
_LABELS = {"id", "parent", "asset id"}
"""First words of header lines that name neither bodies nor columns."""
_IDENTIFIER = re.compile(r"(?=[a-f]*\d)[0-9a-f]+")
"""An identifier of OptiTrack's program, in lower case."""
_RATES = ("export frame rate", "capture frame rate", "frequency", "objects", "segments")
"""Names of the rate in the headers of OptiTrack's, Qualisys' and Vicon's programs."""
_PROGRAMS = {"take name": "OptiTrack", "rotation type": "OptiTrack", "body_names": "Qualisys", "dtrack": "DTrack"}
"""Name in the header -> what writes it."""
MILLIMETRE_PROGRAMS = ("Qualisys", "DTrack")
"""Programs that write lengths in mm, without a word about it."""
_MOST_NAMED = 8
"""Most columns that are named one by one as not read."""


@dataclass(frozen=True)
class TableColumns:
    """The meaning of the columns of a table."""

    bodies: tuple[BodyColumns, ...]
    time: int | None
    frame: int | None
    """Column of the number of the sample."""
    body: int | None
    """Column of the name or number of the body in each row."""
    nanoseconds: int | None = None
    """Column of nanoseconds that are added to the whole seconds of `time`."""
    text_time: str = ""
    """Name of a column of times that are written as text; "" if there is none."""
    time_unit: str = ""
    """Unit that the header states, that of dates and times of day; "" if none."""
    dated: bool = False
    """Whether `time` holds dates or times of day, which are read in seconds."""
    length_unit: str = ""
    rate_hz: float | None = None
    """Rate that the header states [Hz]."""
    order: str = ""
    """Order of a quaternion's components in the file, such as "xyzw"; "" where no names tell it."""
    order_reason: str = ""
    angle_unit: str = ""
    """Unit of angles that the header states; "" if none."""
    program: str = ""
    """What wrote the file: `OptiTrack`, `Qualisys` or `DTrack`; "" for others."""
    findings: tuple[FileFinding, ...] = ()


def find_columns(head: TableHead, names: Sequence[str] | None = None, *, angles: bool = False) -> TableColumns:
    """Conclude the meaning of the columns from `names`, the header, or the numbers. Raises BadFile.

    With `angles` a body may have angles in place of a quaternion or matrix.
    """
    if names is not None:
        if len(names) > head.columns:
            found = f"{head.columns} columns, where --columns names {len(names)}"
            raise BadFile(head.path, found, "no more names than columns", COLUMNS_ADVICE)
        paths = [(name,) for name in (*names, *["-"] * (head.columns - len(names)))]
        return _from_names(head, paths, "given by --columns", {}, angles=angles)
    facts = _facts(head.header)
    if facts.get("rotation type", "quaternion").lower() != "quaternion" and not angles:
        found = f"rotations of the type {facts['rotation type']}"
        advice = f"Export with the rotation type Quaternion, or give --euler {facts['rotation type'].lower()}."
        raise BadFile(head.path, found, "quaternions", advice)
    rows = [row for row in (_fit(row, head.columns) for row in head.header) if row]
    scores = [sum(parse_column_name([cell]).kind not in ("", "body") for cell in row) for row in rows]
    best = max(range(len(rows)), key=lambda n: (scores[n], n), default=None)
    own = [] if best is None else [parse_column_name([cell]) for cell in rows[best]]
    turn = {name.axis for name in own if name.kind == "quaternion"} == set(QUATERNION)
    if best is None or (scores[best] < min(6, head.columns) and not turn):
        return _from_numbers(head)
    above = [_spread(row) for row in _context(rows[:best], _program(facts))]
    cells: list[tuple[str, ...]] = [(*(row[c] for row in above), rows[best][c]) for c in range(head.columns)]
    if _program(facts) == "Qualisys":
        listed = next((row[1:] for row in head.header if row[0].lower() == "body_names"), ())
        cells = _name_bodies(rows[best], listed)
    units = rows[best + 1] if best + 1 < len(rows) else ("",) * head.columns
    return _from_names(head, cells, "the header's names", facts, units, angles=angles)


def _fit(row: Sequence[str], columns: int) -> tuple[str, ...]:
    """A header line with a cell for each column; empty for a line that has more, or far fewer."""
    cells = list(row)
    if len(cells) != columns:
        words = re.split(r"[\s,;]+", " ".join(row).strip())
        cells = words if len(words) == columns else cells
    if len(cells) > columns or len(cells) < 2:
        return ()
    return (*cells, *[""] * (columns - len(cells)))


def _program(facts: Mapping[str, str]) -> str:
    return next((program for name, program in _PROGRAMS.items() if name in facts), "")


def _context(rows: Sequence[tuple[str, ...]], program: str) -> list[tuple[str, ...]]:
    """The header lines that may name bodies or the kind of the columns below: nothing stands over the first one."""
    labels = [next((cell.lower() for cell in row if cell), "") for row in rows]
    kept = [row for row, label in zip(rows, labels, strict=True) if label and not row[0] and label not in _LABELS]
    identifiers = [row for row in kept if all(_IDENTIFIER.fullmatch(cell.lower()) for cell in row if cell)]
    if program == "OptiTrack" and identifiers:
        kept.remove(identifiers[-1])  # a line before it may hold names of that form
    return kept


def _name_bodies(row: Sequence[str], listed: Sequence[str]) -> list[tuple[str, ...]]:
    """The cells of Qualisys' header with the name of the body above: it stands before X alone, or the names are listed.

    Older files have the list alone.
    """
    out, body, names = list[tuple[str, ...]](), "", iter(listed)
    for cell in row:
        name, _, last = cell.rpartition(" ")
        body, own = (name or next(names, ""), last) if last == "X" else (body, cell)
        out.append((body, own))
    return out


def _spread(row: Sequence[str]) -> list[str]:
    """The cells of a line; where most are empty, each one counts for those that follow."""
    cells = list(row)
    if sum(map(bool, cells)) < len(cells) / 3:
        for c in range(1, len(cells)):
            cells[c] = cells[c] or cells[c - 1]
    return [":".join(dict.fromkeys(cell.split(":"))) for cell in cells]


def _facts(header: Sequence[Sequence[str]]) -> dict[str, str]:
    """Names and values of header lines such as `Length Units,Meters`, or of two lines with a cell each."""
    filled = [[cell for cell in row if cell] for row in header]
    pairs = [pair for row in header for pair in pairwise(row)]
    pairs += [(a[0], b[0]) for a, b in pairwise(filled) if len(a) == len(b) == 1]
    return {name.lower(): value for name, value in pairs if name and value}


def _from_names(
    head: TableHead,
    paths: Sequence[Sequence[str]],
    source: str,
    facts: Mapping[str, str],
    units: Sequence[str] = (),
    *,
    angles: bool,
) -> TableColumns:
    names = [parse_column_name(path) if path[-1] != "-" else ColumnName("") for path in paths]
    bodies = group_columns(head.path, names, paths, head.text_columns, angles=angles)
    chosen = [c for body in bodies for c in (*body.position, *body.rotation, *body.valid)]
    time, frame = _first(names, "time", head.text_columns), _first(names, "frame", head.text_columns)
    nanoseconds = _first(names, "nanoseconds", head.text_columns)
    time_unit = "" if time is None else names[time].unit or _unit_of(units, time, TIME_UNITS_S)
    if time is None and nanoseconds is not None:
        time, nanoseconds, time_unit = nanoseconds, None, "ns"
    dated = time in head.word_columns
    body_column = _first(names, "body") if len(bodies) == 1 else None
    program = _program(facts)
    lengths = {names[c].unit or _unit_of(units, c, LENGTH_UNITS_M) for body in bodies for c in body.position}
    lengths.add(next((find_unit(facts[key], LENGTH_UNITS_M) for key in ("length units", "units") if key in facts), ""))
    lengths.add("mm" if program in MILLIMETRE_PROGRAMS else "")
    rate = next((facts[key] for key in _RATES if key in facts), "")
    used = {*chosen, time, nanoseconds, body_column, frame}
    return TableColumns(
        bodies,
        time,
        frame,
        body_column,
        nanoseconds,
        text_time=next((paths[c][-1] for c in sorted(head.text_columns) if names[c].kind == "time"), ""),
        time_unit="s" if dated else time_unit,
        dated=dated,
        length_unit=max(lengths),
        rate_hz=float(rate) if re.fullmatch(r"\d+(\.\d+)?", rate) and float(rate) > 0.0 else None,
        order="".join(names[c].axis for c in bodies[0].rotation) if len(bodies[0].rotation) == 4 else "",
        order_reason="q0 is the real part in most programs" if any(names[c].numbered for c in chosen) else source,
        angle_unit=max(names[c].unit or _unit_of(units, c, ANGLE_UNITS_RAD) for c in bodies[0].rotation),
        program=program,
        findings=_describe(bodies, names, paths, source, time, used),
    )


def _describe(
    bodies: Sequence[BodyColumns],
    names: Sequence[ColumnName],
    paths: Sequence[Sequence[str]],
    source: str,
    time: int | None,
    used: Container[int | None],
) -> tuple[FileFinding, ...]:
    """What the columns of the first body are, and which columns nothing uses."""
    shown, first = ["/".join(filter(None, path)) for path in paths], bodies[0]
    text = [
        *([] if time is None else [paths[time][-1]]),
        *(shown[c] for c in sorted((*first.position, *first.rotation))),
    ]
    findings = [FileFinding("columns", ", ".join([*text, *["..."] * (len(bodies) > 1)]), source)]
    if len(first.rotation) == 9:
        by_number = len(names[first.rotation[0]].axis) == 1
        reason = "the order of Qualisys and DTrack" if by_number else "the names count rows and columns"
        findings.append(FileFinding("rotation", "matrix" + ", column by column" * by_number, reason))
    named = [c for c, path in enumerate(paths) if c not in used and path[-1] not in ("", "-")]
    if rest := list(dict.fromkeys(shown[c] for c in named)):
        more = f" and {len(rest) - _MOST_NAMED} others" if len(rest) > _MOST_NAMED else ""
        unknown = any(names[c].kind == "valid" for c in named)
        reason = "not needed for times and poses" + ", or words of unknown meaning" * unknown
        findings.append(FileFinding("not read", ", ".join(rest[:_MOST_NAMED]) + more, reason))
    return tuple(findings)


def _first(names: Sequence[ColumnName], kind: str, without: Container[int] = ()) -> int | None:
    """The first column of a kind; of times the device's own."""
    found = [c for c, name in enumerate(names) if name.kind == kind and c not in without]
    order = {"measured": 0, "stamp": 1, "received": 3, "date": 4}
    return min(found, key=lambda c: (order.get(names[c].axis, 2), c), default=None)


def _unit_of(units: Sequence[str], column: int, known: dict[str, float]) -> str:
    return find_unit(units[column], known) if column < len(units) else ""


def _from_numbers(head: TableHead) -> TableColumns:
    """Columns of a table without names: four of norm 1 are a quaternion, three beside them the position."""
    number = [c for c in range(head.columns) if c not in head.text_columns]
    lead, count = len(number) % 7, len(number) // 7
    for before, bodies in ((lead, count), (1, 1), (0, 1), (2, 1)):  # columns before the poses, and bodies
        starts = [number[before + 7 * n : before + 7 * n + 7] for n in range(bodies)]
        for position, quaternion in ((slice(0, 3), slice(3, 7)), (slice(4, 7), slice(0, 4))):
            whole = bool(starts) and len(starts[-1]) == 7
            if before <= 2 and whole and all(_has_norm_1(head, start[quaternion]) for start in starts):
                found = tuple(BodyColumns("", tuple(s[position]), tuple(s[quaternion])) for s in starts)
                return _without_names(head, number[:before], found)
    what = f"no four columns of norm 1 where a quaternion may stand, in {head.form}"
    if lead <= 2 and len(norms := _norms(head, last := number[lead + 3 : lead + 7])):
        what += f"; columns {last[0] + 1} to {last[-1] + 1} have the norm {np.median(norms):.4g}"
    if len(number) < 7:
        what = f"rows of {len(number)} numbers, where a pose has 7, or 12 in a matrix"
    raise BadFile(head.path, what, EXPECTED_COLUMNS, COLUMNS_ADVICE)


def _has_norm_1(head: TableHead, columns: Sequence[int]) -> bool:
    """Whether columns hold quaternions, in nearly all rows that have numbers there."""
    norms = _norms(head, columns)
    return len(norms) > 0 and float(np.mean(np.abs(norms - 1.0) < NORM_TOLERANCE)) > 0.95


def _norms(head: TableHead, columns: Sequence[int]) -> Floats:
    """Those of the rows that have numbers there, and not zeros alone."""
    with np.errstate(over="ignore"):
        norms: Floats = np.sqrt(np.sum(head.rows[:, columns] ** 2, axis=1))
    return norms[np.isfinite(norms) & (norms > 0.0)]


def _without_names(head: TableHead, before: Sequence[int], bodies: tuple[BodyColumns, ...]) -> TableColumns:
    body = min(head.text_columns, default=None) if len(bodies) == 1 else None
    if len(before) == 2 and body is None and len(np.unique(head.rows[:, before[1]])) <= max(len(head.rows) // 10, 1):
        body = before[1]  # the number of a body: it has few values
    place, turn = bodies[0].position, bodies[0].rotation
    parts = [
        *([f"time {before[0] + 1}"] if before else []),
        f"position {place[0] + 1} to {place[-1] + 1}",
        f"quaternion {turn[0] + 1} to {turn[-1] + 1}",
        *([f"and so on for {len(bodies)} bodies"] if len(bodies) > 1 else []),
        *([f"body {body + 1}"] if body is not None else []),
    ]
    finding = FileFinding("columns", ", ".join(parts), "no header; a quaternion's columns have the norm 1")
    time = before[0] if before else None
    dated = time in head.word_columns
    unit = "s" if dated else ""
    return TableColumns(bodies, time, None, body, time_unit=unit, dated=dated, findings=(finding,))
