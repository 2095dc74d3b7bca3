"""A calibration kept in a file: TOML that a person can read, and exactly what was found when it is read again.

Metres and unit quaternions (w, x, y, z) in every key; a table for each station, in the order of the stream's rows.
What `[told]` holds is for whoever reads the file; nothing is taken from it.
"""

import string
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.core.calibration import Calibration
from harness.core.fields import build
from harness.core.files import read_toml, write_bytes
from harness.core.humanoid24 import BONES, standard_skeleton
from harness.core.skeleton import Skeleton
from harness.errors import BadFile, BadInput, HarnessError

SCHEMA = 1
EXPECTED = "a calibration"
_ADVICE = "`harness calibrate` writes one; docs/calibration.md has the format."
_UNIT_TOLERANCE = 1e-6
"""A quaternion's length is 1 within this; copied by hand to seven digits it still is."""
_LONGEST_M = 1.0
"""No bone of a person is longer."""
_BARE_KEY_CHARACTERS = frozenset(string.ascii_letters + string.digits + "_-")
"""What a key of TOML may be made of without quotes."""
_HEAD_COMMENT = """\
# Where trackers are worn, by whom, and how the tracker's frame stands in the room. Written by `harness calibrate`.
# Metres and unit quaternions (w, x, y, z); `a_from_b` takes b into a. docs/calibration.md says how to use it."""
_ROOM_COMMENT = "# The tracker's frame in the world: z is up, and the performer stood at the origin facing x."
_STATION_COMMENT = "# Its origin in the frame of the bone that carries it, and how it is turned there."
_BONES_COMMENT = "# From each bone's joint to its far end, in the rest pose: x forward, y left, z up."
_DIAGNOSTICS_COMMENT = "# For whoever reads this; nothing is taken from here."


@dataclass(frozen=True, eq=False)
class CalibrationFile:
    """What a file holds."""

    calibration: Calibration
    skeleton: Skeleton | None
    """The performer's, with the standard body's hinges; None leaves the body to the scenario."""
    diagnostics: Mapping[str, Any] = field(default_factory=dict)
    """How it was come by: texts, numbers, truth values, and lists and mappings of them."""

    def select(self, stations: Sequence[str]) -> "CalibrationFile":
        """The same for these stations, in this order; BadInput names the first that is not in it."""
        known = self.calibration
        for name in stations:
            if name not in known.stations:
                raise BadInput(
                    f"Station {name!r} is not in the calibration, which has {', '.join(known.stations)}.",
                    "Wear what was calibrated, name the stations as they were then, or calibrate again.",
                )
        rows = [known.stations.index(name) for name in stations]
        chosen = replace(
            known,
            stations=tuple(stations),
            bones=tuple(known.bones[row] for row in rows),
            mount_m=known.mount_m[rows],
            bone_from_station=known.bone_from_station[rows],
        )
        return replace(self, calibration=chosen)


@dataclass(frozen=True)
class _RoomTable:
    world_from_tracker: tuple[float, float, float, float]
    tracker_origin_m: tuple[float, float, float]


@dataclass(frozen=True)
class _StationTable:
    bone: str
    mount_m: tuple[float, float, float]
    bone_from_station: tuple[float, float, float, float]


@dataclass(frozen=True)
class _FileContent:
    """The file as TOML has it."""

    schema: int
    kind: str
    room: _RoomTable
    station: dict[str, _StationTable]
    bone_m: dict[str, tuple[float, float, float]] | None = None
    told: dict[str, Any] = field(default_factory=dict)


def require_writable(path: Path, *, force: bool) -> None:
    """BadFile when a calibration cannot be written there, or would be written over."""
    if path.exists() and not path.is_file():
        raise BadFile(path, "it is no file", "a place for a calibration", "Name another.")
    if path.exists() and not force:
        raise BadFile(path, "it exists", "no such file yet", "Name another, or say --force to write over it.")
    if not path.absolute().parent.is_dir():
        raise BadFile(path, "there is no such folder", "a place for a calibration", "Make it, or name another.")


def write_calibration(path: Path, kept: CalibrationFile, *, force: bool = False) -> None:
    """There whole or not at all; BadFile as `require_writable` says, BadInput for a skeleton of other joints."""
    require_writable(path, force=force)
    target = path.resolve()  # what a link points to is replaced, not the link
    text = "\n".join(_lines(kept)) + "\n"
    try:
        write_bytes(target, text.encode("utf-8", errors="replace"))
    except OSError as error:
        raise BadFile(path, f"it cannot be written ({error.strerror})", "a file", "Name another.") from error


def read_calibration(path: Path | str) -> CalibrationFile:
    """BadFile for what is no calibration, comes from a newer version, or cannot be true."""
    path = Path(path)
    content = read_toml(path, EXPECTED, _ADVICE)
    schema = content.get("schema")
    if schema != SCHEMA:
        advice = "This version of the harness reads no other."
        raise BadFile(path, "no schema" if schema is None else f"schema {schema!r}", f"schema {SCHEMA}", advice)
    try:
        told = build(_FileContent, content, "calibration")
        return CalibrationFile(_calibration(told), _skeleton(told), told.told)
    except (TypeError, ValueError, HarnessError) as error:
        raise BadFile(path, str(error).rstrip("."), EXPECTED, _ADVICE) from error


def _calibration(content: _FileContent) -> Calibration:
    """ValueError for what cannot be."""
    if not content.station:
        raise ValueError("no stations")
    for name, station in content.station.items():
        if station.bone not in BONES:
            raise ValueError(f"station.{name}.bone = {station.bone!r} is no bone of {', '.join(BONES)}")
        _require_unit(f"station.{name}.bone_from_station", station.bone_from_station)
        if np.linalg.norm(station.mount_m) > _LONGEST_M:
            raise ValueError(f"station.{name}.mount_m is more than {_LONGEST_M:g} m from its bone")
    _require_unit("room.world_from_tracker", content.room.world_from_tracker)
    worn = content.station.values()
    return Calibration(
        kind=content.kind,
        stations=tuple(content.station),
        bones=tuple(station.bone for station in worn),
        mount_m=np.array([station.mount_m for station in worn]),
        bone_from_station=np.array([station.bone_from_station for station in worn]),
        world_from_tracker=np.array(content.room.world_from_tracker),
        tracker_origin_m=np.array(content.room.tracker_origin_m),
    )


def _skeleton(content: _FileContent) -> Skeleton | None:
    """ValueError for other bones than the body's, or for lengths that nobody has."""
    if content.bone_m is None:
        return None
    if set(content.bone_m) != set(BONES):
        wrong = sorted(set(content.bone_m) ^ set(BONES))
        raise ValueError(f"bone_m: {', '.join(wrong)}: missing, or no bone of the body's {len(BONES)}")
    own = standard_skeleton().with_bones(np.array([content.bone_m[name] for name in BONES]))
    for name, length_m in zip(BONES, own.length_m, strict=True):
        if not 0.0 < length_m < _LONGEST_M:
            raise ValueError(f"bone_m.{name} is {length_m:g} m long")
    return own


def _require_unit(key: str, quaternion: Sequence[float]) -> None:
    length = float(np.linalg.norm(quaternion))
    if abs(length - 1.0) > _UNIT_TOLERANCE:
        raise ValueError(f"{key} is no unit quaternion: its length is {length:.6g}")


def _lines(kept: CalibrationFile) -> Iterator[str]:
    known = kept.calibration
    yield from (_HEAD_COMMENT, f"schema = {SCHEMA}", f"kind = {_value(known.kind)}", "", _ROOM_COMMENT, "[room]")
    yield f"world_from_tracker = {_value(known.world_from_tracker.tolist())}"
    yield f"tracker_origin_m = {_value(known.tracker_origin_m.tolist())}"
    yield from ("", _STATION_COMMENT)
    for row, name in enumerate(known.stations):
        yield f"[station.{_key(name)}]"
        yield f"bone = {_value(known.bones[row])}"
        yield f"mount_m = {_value(known.mount_m[row].tolist())}"
        yield f"bone_from_station = {_value(known.bone_from_station[row].tolist())}"
        yield ""
    if kept.skeleton is not None:
        standard = standard_skeleton()
        if kept.skeleton.names != standard.names or not np.allclose(
            kept.skeleton.axes, standard.axes, atol=_UNIT_TOLERANCE
        ):
            raise BadInput("A skeleton of other joints than the body's.", "Calibrate on the standard body's joints.")
        yield from (_BONES_COMMENT, "[bone_m]")
        for bone, vector_m in zip(BONES, kept.skeleton.bone_m.tolist(), strict=True):
            yield f"{bone} = {_value(vector_m)}"
        yield ""
    yield from (_DIAGNOSTICS_COMMENT, *_table("told", kept.diagnostics))


def _table(name: str, content: Mapping[str, Any]) -> Iterator[str]:
    """Values first, since what follows a table's head belongs to it."""
    yield f"[{name}]"
    for key, value in content.items():
        if not isinstance(value, Mapping):
            yield f"{_key(key)} = {_value(value)}"
    for key, value in content.items():
        if isinstance(value, Mapping):
            yield ""
            yield from _table(f"{name}.{_key(key)}", value)


def _key(name: str) -> str:
    return name if name and set(name) <= _BARE_KEY_CHARACTERS else _value(name)


def _value(value: Any) -> str:
    """Of a number every digit; TypeError for what TOML has no word for."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(float(value))  # numpy's own say their type
    if isinstance(value, int):
        return str(value)
    if isinstance(value, str):
        return f'"{"".join(map(_character, value))}"'
    if isinstance(value, Sequence):
        return f"[{', '.join(map(_value, value))}]"
    raise TypeError(f"{value!r} cannot be written")


def _character(one: str) -> str:
    if one in '"\\':
        return f"\\{one}"
    return f"\\u{ord(one):04x}" if ord(one) < 0x20 or ord(one) == 0x7F else one
