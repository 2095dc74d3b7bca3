"""Bodies among named columns: a position with a quaternion, a matrix or angles each."""

from collections.abc import Container, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from harness.errors import BadFile
from harness.stream.poses.column_names import AXES, ColumnName

EXPECTED_COLUMNS = "columns of a time, a position and a quaternion"
COLUMNS_ADVICE = (
    "Name the columns in their order, - for others: --columns time,x,y,z,qx,qy,qz,qw; of angles roll,pitch,yaw with "
    "--euler."
)
QUATERNION = ("w", "x", "y", "z")
_MATRICES = [set("012345678"), *({f"{r}{c}" for r in three for c in three} for three in ("012", "123"))]
"""Names of the elements of a matrix: column by column, or by row and column."""
_TRANSLATIONS = [("03", "13", "23"), ("14", "24", "34")]


@dataclass(frozen=True)
class BodyColumns:
    """Columns of one body, from 0."""

    name: str
    """"" where the file does not name it."""
    position: tuple[int, ...]
    """(3,) x, y, z."""
    rotation: tuple[int, ...]
    """(4,) components of a quaternion in the order in which they stand in the file, (9,) a matrix column by column, or
    (3,) angles about x, y, z."""
    valid: tuple[int, ...] = ()
    """Columns that are 0 where the body is not tracked."""


@dataclass
class _Group:
    """Columns of one body while they are collected."""

    name: str
    family: str
    columns: dict[str, int] = field(default_factory=dict)

    def sorted_columns(self) -> tuple[int, ...]:
        """A quaternion's as they stand in the file, a matrix's column by column, those of angles as x, y, z."""
        if len(self.columns) == len(QUATERNION):
            return tuple(sorted(self.columns.values()))
        return tuple(self.columns[axis] for axis in sorted(self.columns, key=lambda axis: axis[::-1]))

    def distance(self, other: "_Group") -> int:
        """Columns between the first ones of two groups."""
        return abs(min(self.columns.values()) - min(other.columns.values()))


def group_columns(
    path: Path, names: Sequence[ColumnName], paths: Sequence[Sequence[str]], texts: Container[int], *, angles: bool
) -> tuple[BodyColumns, ...]:
    """The bodies of a table, from the meaning of each column. Raises BadFile where there is none.

    `paths` are the cells over each column, `texts` columns of words; with `angles` these count as a rotation where
    there are no quaternions and matrices.
    """
    groups: dict[str, list[_Group]] = {"position": [], "quaternion": [], "matrix": [], "angle": []}
    for c, name in enumerate(names):
        if name.kind in groups and c not in texts:
            same = [group for group in groups[name.kind] if (group.name, group.family) == (name.body, name.family)]
            free = next((group for group in same if name.axis not in group.columns), None)
            if free is None:
                groups[name.kind].append(free := _Group(name.body, name.family))
            free.columns[name.axis] = c
    places = _whole(groups["position"], AXES) or list(filter(None, map(_take_translation, groups["matrix"])))
    turns = _whole(groups["quaternion"], QUATERNION) or [g for g in groups["matrix"] if set(g.columns) in _MATRICES]
    if not turns and angles:
        turns = _whole([*groups["angle"], *groups["quaternion"]], AXES)
    valid = [(c, name.body) for c, name in enumerate(names) if name.kind == "valid" and c not in texts]
    if bodies := _pair(places, turns, valid):
        return bodies
    shown = [paths[c][-1] for kind in ("angle", "quaternion") for g in groups[kind] for c in g.columns.values()]
    if places and not turns and len(shown) >= len(AXES):
        found = f"angles ({', '.join(shown[:6])}) of a convention that the file does not name"
        advice = "Export quaternions, or name the axes in their order: --euler zyx is yaw, then pitch, then roll."
        raise BadFile(path, found, "quaternions or matrices", advice)
    lacks = "position" if not places else "quaternion" if not turns else "body with both of them"
    columns = ", ".join("/".join(filter(None, cells)) for cells in paths[:12])
    raise BadFile(path, f"no {lacks} among the columns {columns}", EXPECTED_COLUMNS, COLUMNS_ADVICE)


def _whole(groups: Sequence[_Group], axes: Sequence[str]) -> list[_Group]:
    return [group for group in groups if set(group.columns) == set(axes)]


def _take_translation(group: _Group) -> _Group | None:
    """The position that stands on the right of a matrix of three or four lines, of which its rotation is left."""
    last = next((names for names in _TRANSLATIONS if group.columns.keys() >= {*names}), None)
    if last is None:
        return None
    place = _Group(group.name, group.family, {axis: group.columns[name] for axis, name in zip(AXES, last, strict=True)})
    numbers = {name[0] for name in last}
    group.columns = {name: c for name, c in group.columns.items() if {*name} <= numbers}
    return place


def _pair(
    places: Sequence[_Group], turns: Sequence[_Group], valid: Sequence[tuple[int, str]]
) -> tuple[BodyColumns, ...]:
    """Positions and rotations of the same body; those of the only body may have different names.

    Of several positions of a name, the one beside a rotation belongs to it: others are those of markers.
    `valid` are columns and the names of their bodies; one without a body that is there counts for all.
    """
    pairs = [(place, turn) for place, turn in zip(places, turns, strict=False) if place.name == turn.name]
    if len(places) == len(turns) == 1:
        pairs = [(places[0], turns[0])]
    elif len(pairs) < max(len(places), len(turns)):
        pairs, free = [], list(places)
        for turn in turns:
            if same := [place for place in free if place.name == turn.name]:
                pairs.append((min(same, key=turn.distance), turn))
                free.remove(pairs[-1][0])
    known = {place.name or turn.name for place, turn in pairs}
    return tuple(
        BodyColumns(
            (name := place.name or turn.name),
            tuple(place.columns[axis] for axis in AXES),
            turn.sorted_columns(),
            tuple(c for c, body in valid if body == name or body not in known),
        )
        for place, turn in pairs
    )
