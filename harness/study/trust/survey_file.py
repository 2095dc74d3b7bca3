"""Surveyed points: a text with the coordinates x, y, z [m] of a point on each line, in the order of the rests.

Commas, semicolons or spaces separate numbers. A first line of words and lines that begin with # are left out.
"""

import re
from pathlib import Path

import numpy as np

from harness.core.arrays import Floats
from harness.core.input_file import MEGABYTE, read_input_file
from harness.errors import BadFile

_EXPECTED = "lines of x, y, z in metres"


def read_surveyed_points(path: Path) -> Floats:
    """The points (K, 3) [m]. BadFile that names the line."""
    try:
        lines = read_input_file(path, _EXPECTED, MEGABYTE).decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise BadFile(path, "bytes that are no text", _EXPECTED, "Is it the right file?") from error
    rows: list[list[float]] = []
    for number, line in enumerate(lines, 1):
        words = re.split(r"[,;\s]+", line.strip().strip(",;"))
        if not line.strip() or line.lstrip().startswith("#") or (not rows and not _is_number(words[0])):
            continue
        if len(words) != 3 or not all(map(_is_number, words)):
            raise BadFile(path, "no three numbers", _EXPECTED, "Look at that line.", number)
        rows.append([float(word) for word in words])
    points_m = np.array(rows).reshape(-1, 3)
    if not np.isfinite(points_m).all():
        raise BadFile(path, "a coordinate that is not finite", _EXPECTED, "Look at the file.")
    return points_m


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
