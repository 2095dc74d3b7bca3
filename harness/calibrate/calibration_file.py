"""Calibration files: human-readable TOML that reads back bit for bit.

Keys hold metres and unit quaternions (w, x, y, z). There is a table for each station, in the order of the stream's
rows. The table `[diagnostics]` is information for people. The first line is a digest of all others
(`core.toml_file`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from harness.core.calibration import Calibration
from harness.core.fields import build
from harness.core.files import write_output
from harness.core.humanoid24 import BONES, standard_skeleton
from harness.core.skeleton import Skeleton
from harness.core.toml_file import EARLIER_SCHEMA, SCHEMA, format_toml, insert_toml_digest, read_digested_toml
from harness.errors import BadFile, BadInput, HarnessError

EXPECTED = "a calibration"
_ADVICE = "`harness calibrate` writes one; docs/calibration.md has the format."
_UNIT_TOLERANCE = 1e-6
"""Tolerance of a quaternion's length; seven digits copied by hand are enough."""
_LONGEST_M = 1.0
"""Longest bone or mount that is accepted [m]."""
_HEAD_COMMENT = """\
# Station mounts, the performer's bones, and the tracker's frame in the room. Written by `harness calibrate`.
# Metres and unit quaternions (w, x, y, z); `a_from_b` takes b into a. docs/calibration.md says how to use it."""
_ROOM_COMMENT = "# The tracker's frame in the world: z is up; the performer stood at the origin and faced x."
_STATION_COMMENT = "# Position and orientation of each station in the frame of the bone that carries it."
_BONES_COMMENT = "# Vector from each bone's joint to its far end in the rest pose: x forward, y left, z up."
_DIAGNOSTICS_COMMENT = "# Information for people; the harness does not read this table."


@dataclass(frozen=True, eq=False)
class CalibrationFile:
    """Content of a calibration file."""

    calibration: Calibration
    skeleton: Skeleton | None
    """The performer's skeleton, with the standard body's hinges; None leaves the body to the scenario."""
    diagnostics: Mapping[str, Any] = field(default_factory=dict)
    """Quality figures of the calibration: strings, numbers, booleans, and lists and mappings of them."""
    performer: str = ""
    """Who was calibrated; "" where nobody said it, as of a person without a clip."""
    caveat: str = ""
    """What cannot be verified of the file that it was read from; "" if its digest fits."""

    def difference(self, stations: Sequence[str]) -> str:
        """Both lists, where the worn stations are not the calibrated ones in the same order; else nothing."""
        if tuple(stations) == self.calibration.stations:
            return ""
        return f"the calibration is of {', '.join(self.calibration.stations)}; worn are {', '.join(stations)}"

    def select(self, stations: Sequence[str]) -> "CalibrationFile":
        """A copy with these stations only, in this order; BadInput names the first that is missing."""
        known = self.calibration.stations
        for name in stations:
            if name not in known:
                raise BadInput(
                    f"Station {name!r} is not in the calibration, which has {', '.join(known)}; "
                    f"worn are {', '.join(stations)}.",
                    "Wear the calibrated stations, use the names they had then, or calibrate again.",
                )
        return replace(self, calibration=self.calibration.of_stations(stations))


@dataclass(frozen=True, eq=False)
class CalibrationOutcome:
    """A calibration and its report."""

    file: CalibrationFile
    lines: list[str]


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
    """Tables of the TOML file."""

    RENAMED_KEYS: ClassVar[Mapping[str, str]] = {"told": "diagnostics"}

    schema: int
    kind: str
    room: _RoomTable
    station: dict[str, _StationTable]
    performer: str = ""
    bone_m: dict[str, tuple[float, float, float]] | None = None
    diagnostics: dict[str, Any] = field(default_factory=dict)


def write_calibration(path: Path, content: CalibrationFile, *, force: bool = False) -> None:
    """Write a calibration file atomically; BadFile as `require_writable`, BadInput for a skeleton of other joints."""
    write_output(path, insert_toml_digest(_text(content)), EXPECTED, force=force)


def read_calibration(path: Path | str) -> CalibrationFile:
    """Read a calibration file.

    BadFile for anything else, for another schema, for a file that is cut, damaged or edited, and for impossible values.
    """
    path = Path(path)
    content, caveat = read_digested_toml(path, EXPECTED, _ADVICE)
    try:
        tables = build(_FileContent, content, "calibration")
        found = CalibrationFile(_calibration(tables), _skeleton(tables), tables.diagnostics, tables.performer, caveat)
    except (TypeError, ValueError, HarnessError) as error:
        raise BadFile(path, str(error).rstrip("."), EXPECTED, _ADVICE) from error
    if tables.schema == EARLIER_SCHEMA:
        _require_all(path, tables)
    return found


def _require_all(path: Path, content: _FileContent) -> None:
    """BadFile when a file without a digest lacks what `harness calibrate` always wrote: it was cut or lost lines."""
    listed = content.diagnostics.get("stations")
    lost = [f"[station.{name}]" for name in listed if name not in content.station] if isinstance(listed, dict) else []
    if content.bone_m is None and content.kind == "poses":
        lost.append("[bone_m]")
    if not content.diagnostics:
        lost.append("[diagnostics], with which such a file ends")
    if lost:
        raise BadFile(
            path, f"damaged: no {lost[0]}", "a whole calibration", "Restore it from a copy, or calibrate again."
        )


def _calibration(content: _FileContent) -> Calibration:
    """The calibration of a file; ValueError for unknown bones, mounts too far away and bad quaternions."""
    if not content.station:
        raise ValueError("no stations")
    for name, station in content.station.items():
        if station.bone not in BONES:
            raise ValueError(f"station.{name}.bone = {station.bone!r} is not one of the bones {', '.join(BONES)}")
        _require_unit(f"station.{name}.bone_from_station", station.bone_from_station)
        if max(map(abs, station.mount_m)) > _LONGEST_M or np.linalg.norm(station.mount_m) > _LONGEST_M:
            raise ValueError(f"station.{name}.mount_m is more than {_LONGEST_M:g} m from its bone")
    _require_unit("room.world_from_tracker", content.room.world_from_tracker)
    stations = content.station.values()
    return Calibration(
        kind=content.kind,
        stations=tuple(content.station),
        bones=tuple(station.bone for station in stations),
        mount_m=np.array([station.mount_m for station in stations]),
        bone_from_station=np.array([station.bone_from_station for station in stations]),
        world_from_tracker=np.array(content.room.world_from_tracker),
        tracker_origin_m=np.array(content.room.tracker_origin_m),
    )


def _skeleton(content: _FileContent) -> Skeleton | None:
    """The skeleton of a file; ValueError for other bones than the body's and for impossible lengths."""
    if content.bone_m is None:
        return None
    if set(content.bone_m) != set(BONES):
        wrong = sorted(set(content.bone_m) ^ set(BONES))
        raise ValueError(f"bone_m: {', '.join(wrong)}: missing, or not one of the body's {len(BONES)} bones")
    for name, vector_m in content.bone_m.items():
        if max(map(abs, vector_m)) > 1e6:  # squares of much more are too large for a number
            raise ValueError(f"bone_m.{name} is more than 1000 km long")
    skeleton = standard_skeleton().with_bones(np.array([content.bone_m[name] for name in BONES]))
    for name, length_m in zip(BONES, skeleton.length_m, strict=True):
        if not 0.0 < length_m < _LONGEST_M:
            raise ValueError(f"bone_m.{name} is {length_m:g} m long")
    return skeleton


def _require_unit(key: str, quaternion: Sequence[float]) -> None:
    length = float(np.linalg.norm(np.clip(quaternion, -2.0, 2.0)))  # squares of more may be too large for a number
    if abs(length - 1.0) > _UNIT_TOLERANCE:
        raise ValueError(f"{key} is not a unit quaternion: its length is {length:.6g}")


def _text(content: CalibrationFile) -> str:
    calibration = content.calibration
    room = {
        "world_from_tracker": calibration.world_from_tracker.tolist(),
        "tracker_origin_m": calibration.tracker_origin_m.tolist(),
    }
    stations = {
        name: {
            "bone": calibration.bones[row],
            "mount_m": calibration.mount_m[row].tolist(),
            "bone_from_station": calibration.bone_from_station[row].tolist(),
        }
        for row, name in enumerate(calibration.stations)
    }
    performer = {"performer": content.performer} if content.performer else {}
    parts: list[tuple[str, dict[str, Any]]] = [
        (_HEAD_COMMENT, {"schema": SCHEMA, "kind": calibration.kind, **performer}),
        (_ROOM_COMMENT, {"room": room}),
        (_STATION_COMMENT, {"station": stations}),
    ]
    if content.skeleton is not None:
        standard = standard_skeleton()
        if content.skeleton.names != standard.names or not np.allclose(
            content.skeleton.axes, standard.axes, atol=_UNIT_TOLERANCE
        ):
            raise BadInput("The skeleton has other joints than the body.", "Calibrate on the standard body's joints.")
        bones = dict(zip(BONES, content.skeleton.bone_m.tolist(), strict=True))
        parts.append((_BONES_COMMENT, {"bone_m": bones}))
    parts.append((_DIAGNOSTICS_COMMENT, {"diagnostics": content.diagnostics}))
    return "\n".join(f"{comment}\n{format_toml(tables)}" for comment, tables in parts)
