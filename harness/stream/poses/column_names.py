"""What a column of a table holds, by its name: `q_RS_w []`, `head.pos.x`, `TX`, `field.header.stamp`, `time_s`."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from harness.core.units import ANGLE_UNITS_RAD, LENGTH_UNITS_M, TIME_UNITS_S, find_unit

AXES = ("x", "y", "z")
_BRACKET = re.compile(r"[\[(]([^\])]*)[\])]")
_ELEMENT = re.compile(r"(?:(.*)[\W_])?(?:rot|r|m)(?:\[([0-8])\]|_?([0-4])_?([0-4]))", re.IGNORECASE)
"""An element of a matrix: `Rot[0]` to `Rot[8]`, `r11` to `r33`, `m00` to `m33`."""
_TOKEN = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+|[^\W\d_a-zA-Z]+")
_TIME = {
    *("time", "timestamp", "timestamps", "stamp", "t", "ts", "measured", "received", "seconds", "sec", "secs", "epoch"),
    *("elapsed", "datetime", "date", "clock", "utc", "zeit", "uhrzeit", "zeitstempel", "temps", "tiempo", "tempo"),
}
_NANOSECONDS = {"nsec", "nsecs", "nanosec", "nanoseconds"}
_TIME_ORDER = ("measured", "stamp", "time", "timestamp", "received", "date")
"""Words of a time's name; a device's own time comes before the time of reception."""
_FRAME = {"frame", "framenumber", "index", "idx", "seq", "sample", "framenum", "number"}
_BODY = {
    *("station", "body", "name", "object", "tracker", "sensor", "device", "id", "target", "tool", "child", "segment"),
    *("serial", "sta", "stn", "channel", "receiver", "geometry"),
}
_POSITION = {"p", "pos", "position", "trans", "translation", "location", "loc", "xyz", "origin"}
_ROTATION = {"q", "quat", "quaternion", "orientation", "orient", "rotation", "rot", "attitude", "ori", "qua"}
_OTHER = {
    *("v", "vel", "velocity", "acc", "accel", "acceleration", "gyro", "omega", "angular", "linear", "twist", "bias"),
    *("cov", "covariance", "std", "sigma", "error", "imu", "mag", "marker", "markers", "residual", "euler", "scale"),
    *("force", "torque", "variance", "raw"),
}
_FILLERS = {
    *("field", "pose", "poses", "transform", "msg", "message", "data", "rs", "r", "rigid", "bone", "s", "world"),
    *("is", "tracking", "euler", "angle", "angles"),
}
"""Words that name no body."""
_ANGLES = {
    **{"roll": "x", "rx": "x", "pitch": "y", "elevation": "y", "el": "y", "ry": "y"},
    **{"yaw": "z", "azimuth": "z", "heading": "z", "az": "z", "rz": "z", "euler": ""},
}
"""Name of an angle -> axis about which it turns."""
_KNOWN = {*_POSITION, *_ROTATION, *_OTHER, *_FILLERS, *_ANGLES, "body"}
"""Words of a cell above that tells the kind of a column; one with others is the name of a body."""
_VALID = {"valid", "tracked", "validity", "visible", "trackingstate", "trackingstatus"}
_STATES = [["tracking", "state"], ["tracking", "status"]]
_UNITS = {**LENGTH_UNITS_M, **TIME_UNITS_S, **ANGLE_UNITS_RAD}
_IMAGINARY = {"i": "x", "j": "y", "k": "z", "r": "w", "real": "w", "s": "w"}
_NUMBERED = {"q0": "w", "q1": "x", "q2": "y", "q3": "z"}
_LEAVES = {
    **{f"q{axis}": ("quaternion", axis) for axis in "xyzw"},
    **{f"quat{axis}": ("quaternion", axis) for axis in "xyzw"},
    **{f"rot{axis}": ("quaternion", axis) for axis in "xyzw"},
    **{f"r{axis}": ("quaternion", axis) for axis in "xyzw"},
    **{name: ("quaternion", axis) for name, axis in _NUMBERED.items()},
    **{f"q{name}": ("quaternion", axis) for name, axis in _IMAGINARY.items()},
    **{f"{word}{axis}": ("position", axis) for word in ("p", "t", "pos") for axis in AXES},
}
"""Last word of a name -> what the column holds. `rx`, `ry`, `rz` are angles where there is no `rw`."""


@dataclass(frozen=True)
class ColumnName:
    """The meaning of a column's name."""

    kind: str
    """`time`, `nanoseconds` (beside seconds, as in ROS), `frame`, `body`, `position`, `quaternion`, `matrix`, `angle`,
    `valid`, or "" for others."""
    axis: str = ""
    """`x`, `y`, `z` or `w`; of a matrix row and column, or the number of the element; of a time the word that names
    it."""
    body: str = ""
    """What is left of the name when the other words are taken away: the name of a body."""
    unit: str = ""
    """The unit that the name states, such as `mm` or `ns`; "" without one."""
    family: str = ""
    """`r` of `rx` to `rw`, which are another thing than `qx` to `qw` beside them; else empty."""
    numbered: bool = False
    """Whether `q0` to `q3` name the components, so that their order is a convention."""


def parse_column_name(cells: Sequence[str]) -> ColumnName:
    """The meaning of the cells that stand over a column, from the top; the last one is its own name."""
    *above, own = [cell.strip(" \t\"'") for cell in cells]
    bodies = [cell for cell in above if set(_words(cell)) - _POSITION - _ROTATION - _FILLERS - {"body"}]
    if element := _ELEMENT.fullmatch(own):
        body = ".".join(filter(None, (*bodies, element[1])))
        return ColumnName("matrix", "".join(filter(None, element.groups()[1:])), body)
    bracket = _BRACKET.search(own)
    own = _BRACKET.sub("", own)
    found = list(_TOKEN.finditer(own))
    words = [match[0].lower() for match in found]
    unit = bracket[1].strip() if bracket else ""
    if not unit and len(words) > 1 and words[-1] not in _NANOSECONDS and find_unit(words[-1], _UNITS):
        unit = words.pop()
        found.pop()
    if len(words) > 1 and (words[-2] + words[-1] in _NUMBERED or words[-2:] in _STATES):  # the name q0 is two tokens
        words[-2:] = [words[-2] + words[-1]]
        found[-2:] = [found[-2]]
    upper = [word for cell in above if _KNOWN.issuperset(words_above := _words(cell)) for word in words_above]
    if not words:
        return ColumnName("")
    *context, leaf = words
    every = {*upper, *words}
    body = ".".join([*bodies, *([rest] if (rest := _rest(own, found[:-1], context)) else [])])
    if leaf in _VALID:
        return ColumnName("valid", "", body)
    if every & {*_ANGLES} and leaf not in _LEAVES:
        return ColumnName("angle", _ANGLES.get(leaf, leaf), body, find_unit(unit, ANGLE_UNITS_RAD))
    if leaf in _NANOSECONDS:
        return ColumnName("nanoseconds")
    if leaf in _TIME or (context and context[0] in ("time", "timestamp")):
        word = next((word for word in _TIME_ORDER if word in words), "time")
        return ColumnName("time", word, "", find_unit(unit, TIME_UNITS_S))
    if every & _OTHER:
        return ColumnName("")
    kind, axis = _LEAVES.get(leaf, ("", leaf))
    turns = leaf == "w" or not _ROTATION.isdisjoint([*context, *(word for cell in above for word in _words(cell))])
    if not kind and turns and leaf in _IMAGINARY:
        kind, axis = "quaternion", _IMAGINARY[leaf]
    if not kind and leaf in ("x", "y", "z", "w"):
        kind = "quaternion" if turns else "position"
    if kind == "position":
        length = find_unit(unit, LENGTH_UNITS_M)
        return ColumnName(kind, axis, body, length) if length or not unit else ColumnName("")
    if kind:
        family = "r" if leaf in ("rx", "ry", "rz", "rw") else ""
        return ColumnName(kind, axis, body, find_unit(unit, ANGLE_UNITS_RAD), family, numbered=leaf in _NUMBERED)
    if leaf in _FRAME or words[0] in _FRAME:
        return ColumnName("frame")
    return ColumnName("body" if {*words} <= _BODY | {"frame", "rigid"} else "")


def _words(text: str) -> list[str]:
    return [match[0].lower() for match in _TOKEN.finditer(text)]


def _rest(name: str, found: Sequence[re.Match[str]], words: Sequence[str]) -> str:
    """The part of a name that is no axis, position, rotation or filler, as it is written."""
    kept = [
        match
        for match, word in zip(found, words, strict=True)
        if word not in _POSITION and word not in _ROTATION and word not in _FILLERS
    ]
    return name[kept[0].start() : kept[-1].end()] if kept else ""
