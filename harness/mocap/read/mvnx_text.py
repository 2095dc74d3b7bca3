"""Parser of the text of an MVNX file, Xsens MVN's XML format, in versions 3 and 4.

A file names its segments, and the points of each in its own axes. Then it has frames, whose type is `normal` for the
motion and another word for calibration poses (MVN User Manual MV0319P, section 14.4; the schema lies at
http://www.xsens.com/mvn/mvnx/schema.xsd). The file is read piece by piece with expat. A reference to a document type is
passed over and never fetched. Declarations inside the file, which could define entities, are refused.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

import numpy as np

from harness.core.arrays import Floats
from harness.errors import BadFile
from harness.mocap.read.file_checks import check_size, parse_number, parse_numbers

LIMIT_BYTES = 1024 * 2**20
"""Largest MVNX file that is read: about 20 minutes at 60 Hz with everything that MVN exports."""
MAX_FRAMES = 500_000
"""Largest number of frames, which need some 700 MB of memory."""
VERSIONS = ("3", "4")

_FORMAT = "an MVNX motion"
_EXPORT_AGAIN = "Export it again."
_MAX_SEGMENTS, _MAX_POINTS, _MAX_DEPTH, _MAX_TEXT = 100, 10_000, 32, 100_000
_PIECE_BYTES = 2**20
_WIDTHS = {"orientation": 4, "position": 3}


@dataclass
class MvnxText:
    """The contents of a checked MVNX file: S segments and T frames of motion."""

    subject: Mapping[str, str] = field(default_factory=dict)
    """Attributes of the subject, such as `label` and `configuration`."""
    rate_hz: float = 0.0
    points_m: dict[str, dict[str, tuple[float, ...]]] = field(default_factory=dict)
    """Segment -> point -> place in the segment's axes [m]; segments in the order of the frames."""
    orientation: list[Floats] = field(default_factory=list)
    """(S, 4) quaternions (w, x, y, z) of each frame, from the segments' axes to the world's, as in the file."""
    position_m: list[Floats] = field(default_factory=list)
    """(S, 3) origins of the segments in each frame [m]."""


def parse_mvnx(path: Path) -> MvnxText:
    """Read and check an MVNX file; BadFile with the line of the first error."""
    check_size(path, _FORMAT, LIMIT_BYTES)
    return _Reader(path).read()


class _Reader:
    """Handlers of expat's events, which fill the content."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._content = MvnxText()
        self._tags: list[str] = []
        self._texts: list[str] | None = None
        self._segment = self._point = ""
        self._frame: dict[str, Floats] | None = None
        self._last_index: int | None = None
        self._parser = expat.ParserCreate()
        self._parser.buffer_text = True
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._collect
        self._parser.StartDoctypeDeclHandler = self._check_document_type
        self._parser.EntityDeclHandler = self._refuse_entity
        self._parser.SkippedEntityHandler = self._refuse_entity

    def read(self) -> MvnxText:
        try:
            with open(self._path, "rb") as file:
                while piece := file.read(_PIECE_BYTES):
                    self._parser.Parse(piece, False)
            self._parser.Parse(b"", True)
        except expat.ExpatError as error:
            found = f"no well-formed XML ({expat.ErrorString(error.code)})"
            raise BadFile(self._path, found, _FORMAT, f"Is it truncated? {_EXPORT_AGAIN}", error.lineno) from error
        except (LookupError, ValueError) as error:  # of an encoding that Python or expat does not know
            raise self._error(f"no readable text ({error})", _FORMAT, _EXPORT_AGAIN) from error
        except OSError as error:
            raise BadFile(self._path, f"it cannot be read ({error.strerror})", _FORMAT, "Check the path.") from error
        if not self._content.rate_hz or not self._content.orientation:
            raise self._error("no frame of type normal", "at least one", "Is it the export of a recording?")
        return self._content

    def _error(self, found: str, expected: str, advice: str) -> BadFile:
        return BadFile(self._path, found, expected, advice, self._parser.CurrentLineNumber)

    def _check_document_type(self, name: str, system: str | None, public: str | None, declarations: bool) -> None:
        if declarations:
            raise self._error("declarations inside the file", "a plain MVNX file", _EXPORT_AGAIN)

    def _refuse_entity(self, name: str, *rest: object) -> None:
        raise self._error(f"the entity {name:.40}", "a plain MVNX file", _EXPORT_AGAIN)

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        tag = name.rpartition(":")[2]
        self._check_place(tag, attributes)
        self._tags.append(tag)
        match self._tags:
            case [*_, "subject"]:
                self._begin_subject(attributes)
            case [*_, "subject", "segments", "segment"]:
                self._begin_segment(attributes)
            case [*_, "segments", "segment", "points", "point"]:
                self._point = attributes.get("label", "")
            case [*_, "segments", "segment", "points", "point", "pos_b" | "pos_s"]:
                self._texts = []
            case [*_, "frames", "frame"] if attributes.get("type") == "normal":
                self._begin_frame(attributes)
            case [*_, "frames", "frame", "orientation" | "position"] if self._frame is not None:
                self._texts = []

    def _check_place(self, tag: str, attributes: dict[str, str]) -> None:
        if len(self._tags) >= _MAX_DEPTH:
            raise self._error(f"elements inside each other {_MAX_DEPTH} times", _FORMAT, _EXPORT_AGAIN)
        if self._tags:
            return
        if tag != "mvnx":
            raise self._error(f"the element {tag:.40}", _FORMAT, "Is it another format under this name?")
        version = attributes.get("version", "")
        if version.partition(".")[0] not in VERSIONS:
            expected = f"version {' or '.join(VERSIONS)}"
            raise self._error(f"MVNX of version {version[:20]!r}", expected, "Export it by MVN Studio 3.5 or later.")

    def _begin_subject(self, attributes: dict[str, str]) -> None:
        if self._content.subject:
            raise self._error("a second subject", "one", "Export each performer to a file of its own.")
        line = self._parser.CurrentLineNumber
        rate_hz = parse_number(self._path, attributes.get("frameRate", ""), "frameRate", line)
        if not 0.0 < rate_hz < 1e5:
            raise self._error(f"a frameRate of {rate_hz:g}", "frames per second", _EXPORT_AGAIN)
        self._content.subject, self._content.rate_hz = attributes, rate_hz

    def _begin_segment(self, attributes: dict[str, str]) -> None:
        self._segment = attributes.get("label", "")
        if self._segment in self._content.points_m or self._content.orientation or not self._segment:
            raise self._error(f"the segment {self._segment[:40]!r}", "a new label, before the frames", _EXPORT_AGAIN)
        if len(self._content.points_m) == _MAX_SEGMENTS:
            raise self._error("more segments", f"at most {_MAX_SEGMENTS}", _EXPORT_AGAIN)
        self._content.points_m[self._segment] = {}

    def _begin_frame(self, attributes: dict[str, str]) -> None:
        if len(self._content.orientation) == MAX_FRAMES:
            raise self._error("more frames", f"at most {MAX_FRAMES:,}", "Export a part of the recording.")
        self._frame, text = {}, attributes.get("index", "")
        if not text:
            return
        if not (text.isascii() and text.isdecimal() and len(text) < 10):
            raise self._error(f"the frame index {text[:20]!r}", "a whole number", _EXPORT_AGAIN)
        index = int(text)
        if self._last_index is not None and index != self._last_index + 1:
            found = f"frame {index} after frame {self._last_index}"
            raise self._error(found, "every frame of the recording in order", "Export it without leaving out frames.")
        self._last_index = index

    def _collect(self, text: str) -> None:
        if self._texts is None:
            return
        self._texts.append(text)
        if sum(map(len, self._texts)) > _MAX_TEXT:
            raise self._error(f"over {_MAX_TEXT:,} characters in {self._tags[-1]}", _FORMAT, _EXPORT_AGAIN)

    def _end(self, name: str) -> None:
        tag = self._tags.pop()
        if self._texts is not None and tag in ("pos_b", "pos_s"):
            self._add_point(self._numbers(3, f"the point {self._point[:40]} of {self._segment[:40]}"))
        elif self._texts is not None and self._frame is not None and tag in _WIDTHS:
            segments, number = len(self._content.points_m), len(self._content.orientation) + 1
            numbers = self._numbers(_WIDTHS[tag] * segments, f"the {tag} of {segments} segments in frame {number}")
            self._frame[tag] = np.array(numbers).reshape(segments, _WIDTHS[tag])
        elif tag == "frame" and self._frame is not None:
            self._end_frame(self._frame)
            self._frame = None
        self._texts = None

    def _numbers(self, count: int, what: str) -> list[float]:
        words = "".join(self._texts or ()).split()
        return parse_numbers(self._path, words, count, what, self._parser.CurrentLineNumber)

    def _add_point(self, place_m: list[float]) -> None:
        points = self._content.points_m[self._segment]
        if len(points) == _MAX_POINTS:
            raise self._error(f"more points of {self._segment[:40]}", f"at most {_MAX_POINTS:,}", _EXPORT_AGAIN)
        points[self._point] = tuple(place_m)

    def _end_frame(self, frame: Mapping[str, Floats]) -> None:
        number = len(self._content.orientation) + 1
        if missing := [tag for tag in _WIDTHS if tag not in frame]:
            advice = "Export it with orientations and positions of the segments."
            raise self._error(f"frame {number} without {missing[0]}", " and ".join(_WIDTHS), advice)
        size = np.linalg.norm(frame["orientation"], axis=1)
        if not np.all(np.abs(size - 1.0) < 0.01):
            found = f"a quaternion of length {size[np.argmax(np.abs(size - 1.0))]:.3g} in frame {number}"
            raise self._error(found, "unit quaternions", _EXPORT_AGAIN)
        self._content.orientation.append(frame["orientation"])
        self._content.position_m.append(frame["position"])
