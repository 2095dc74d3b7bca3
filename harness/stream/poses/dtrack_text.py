"""Text logs of ART's DTrack as a table, a line for each body: time, name, position and matrix.

A frame of such a log is some lines, each with a keyword: `fr` its number, `ts` its time [s], and `6d`, `6di`, `6df` or
`6df2` blocks `[id quality ...][x y z ...][b0 ... b8]` of bodies [mm], with the matrix column by column (DTrack2 user
manual, appendix B.2). Bodies that are not tracked are missing, or have a quality of -1 or a status of 0.
"""

import io
import re
import sys
from collections.abc import Iterator

_FIRST_LINE = re.compile(r"fr \d+\s*")
_NAMES = {"6d": "body", "6di": "body", "6df": "flystick", "6df2": "flystick"}
"""Keyword of a line -> what its bodies are called."""
_NUMBER = r"-?\d+\.?\d*(?:[eE][+-]?\d+)?"
_BODY = re.compile(
    rf"\[(\d+) ({_NUMBER})[^\]]*\]\s*\[({_NUMBER}(?: {_NUMBER}){{2}})[^\]]*\]\s*\[({_NUMBER}(?: {_NUMBER}){{8}})\]"
)
_COLUMNS = ",body,x [mm],y [mm],z [mm]," + ",".join(f"Rot[{n}]" for n in range(9)) + ",tracked\n"


class DTrackText(io.TextIOBase):
    """The table as a file that is open for reading."""

    @staticmethod
    def recognises(first_line: str) -> bool:
        """Whether a file that begins with this line is such a log."""
        return bool(_FIRST_LINE.fullmatch(first_line))

    def __init__(self, file: io.TextIOWrapper) -> None:
        self._file, self._lines, self._rest = file, _table_lines(file), ""

    def read(self, size: int | None = -1) -> str:
        """The next `size` characters, fewer at the end; all of them without a size."""
        size = sys.maxsize if size is None or size < 0 else size
        parts, length = [self._rest], len(self._rest)
        while length < size and (line := next(self._lines, "")):
            parts.append(line)
            length += len(line)
        text = "".join(parts)
        self._rest = text[size:]
        return text[:size]

    def readline(self, size: int = -1) -> str:  # type: ignore[override]
        """The next line, before the first `read`."""
        return next(self._lines, "")

    def close(self) -> None:
        """Close the log."""
        self._file.close()
        super().close()


def _table_lines(file: io.TextIOWrapper) -> Iterator[str]:
    clock, frame, time_s = "", "", ""
    for line in file:
        keyword, _, rest = line.strip().partition(" ")
        if keyword == "fr":
            frame, time_s = _number(rest), ""
        elif keyword == "ts":
            time_s = _number(rest)
        elif keyword in _NAMES:
            if not clock:
                clock = "frame,time [s]" if time_s else "frame"
                yield "DTrack,log\n"
                yield clock + _COLUMNS
            bodies = _BODY.findall(rest)
            for number, quality, position, matrix in bodies:
                cells = [frame, time_s] if "," in clock else [frame]
                cells += [f"{_NAMES[keyword]}{number}", *position.split(), *matrix.split()]
                yield ",".join([*cells, str(int(float(quality) > 0.0))]) + "\n"
            if rest.partition("[")[0].split()[-1:] != [str(len(bodies))]:
                yield f"# {keyword}: not the stated number of bodies\n"


def _number(text: str) -> str:
    """The text, where it is a number; else none, which is an empty cell."""
    return text if re.fullmatch(_NUMBER, text) else ""
