"""Guided poses on a terminal: the wanted pose and the performer side by side, and a meter of stillness.

Both bodies are drawn as lines of braille dots, seen obliquely from the front as in the pictures of the poses. The
block of lines is replaced in place. Between two updates the cursor stands at its first line, so lines that others
print replace it.
"""

import shutil
from typing import TextIO

import numpy as np

from harness.body import pose_from_qpos
from harness.calibrate import HOLD_S, GuidedPose
from harness.core.arrays import Floats
from harness.core.skeleton import Skeleton

COLUMNS, ROWS = 26, 13
"""Size of a figure in characters; each has 2 x 4 dots."""
_METER = 24
_SETTLING = 0.25
"""The collector's message, which is about a whole hold, is left out from this share of stillness to a full meter."""
_METRES_PER_DOT = 2.1 / (4 * ROWS)
_VIEW_RAD = -0.7
"""Heading from which the camera sees the body, as in `body.rendering`."""
_DOT_BITS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
"""Bit of each dot of a braille character (Unicode U+2800 on)."""
_HEAD_M = 0.1


class PoseTerminal:
    """A `PoseDisplay` on a stream; it stays silent unless the stream is a terminal."""

    def __init__(self, skeleton: Skeleton, stream: TextIO) -> None:
        self._skeleton, self._stream = skeleton, stream
        self._active = stream.isatty()
        self._braille = (stream.encoding or "").lower().replace("-", "").startswith("utf")
        self._drawn = False

    def show(self, guided: GuidedPose) -> None:
        """Replace the block of lines."""
        if not self._active:
            return
        columns, rows = shutil.get_terminal_size()
        figures = self._braille and columns > 2 * COLUMNS + 2 and rows > ROWS + 4
        lines = guided_lines(guided, self._skeleton, figures=figures)
        text = "\n".join(line[: columns - 1] for line in lines)
        self._drawn = True
        self._write(f"\r\033[J{text}\r" + f"\033[{len(lines) - 1}A" * (len(lines) > 1))

    def close(self) -> None:
        """Erase the block."""
        if self._drawn:
            self._drawn = False
            self._write("\r\033[J")

    def _write(self, text: str) -> None:
        self._stream.write(text)
        self._stream.flush()


def guided_lines(guided: GuidedPose, skeleton: Skeleton, *, figures: bool) -> list[str]:
    """Lines of text: with `figures` both bodies side by side, then the meter, the farthest station and the message.

    The message is left out while the meter fills. At a full meter it says why the hold was not taken.
    """
    lines = []
    if figures:
        wanted = draw_figure(guided.target, skeleton)
        you = [""] * ROWS if guided.performer is None else draw_figure(guided.performer.qpos, skeleton)
        lines.append(f"{f'pose {guided.number}':^{COLUMNS}}  {'you':^{COLUMNS}}".rstrip())
        lines += [f"{a:{COLUMNS}}  {b}".rstrip() for a, b in zip(wanted, you, strict=True)]
    filled = round(_METER * guided.still_share)
    meter = "#" * filled + "." * (_METER - filled)
    lines.append(f"still [{meter}] {min(guided.still_s, HOLD_S):.1f} of {HOLD_S:.1f} s; {guided.distance_text()}")
    filling = _SETTLING <= guided.still_share < 1.0
    return [*lines, *([guided.message] if guided.message and not filling else [])]


def draw_figure(qpos: Floats, skeleton: Skeleton) -> list[str]:
    """`ROWS` lines of `COLUMNS` braille characters: the bones of a configuration (55,), the root in the middle."""
    pose = pose_from_qpos(skeleton, qpos[None])
    start_m = pose.start_m[0]
    end_m = start_m + (pose.world_from_bone[0] @ skeleton.bone_m[:, :, None])[..., 0]
    share = np.linspace(0.0, 1.0, 40)[:, None, None]
    points_m = (start_m + share * (end_m - start_m)).reshape(-1, 3)
    circle = np.linspace(0.0, 2.0 * np.pi, 40)[:, None]
    right = np.array([-np.sin(_VIEW_RAD), np.cos(_VIEW_RAD), 0.0])
    head_m = end_m[skeleton.index("head")] - np.array([0.0, 0.0, _HEAD_M / 2.0])
    ring_m = head_m + _HEAD_M * (np.cos(circle) * right + np.sin(circle) * [0.0, 0.0, 1.0])
    across_m, up_m = (np.concatenate([points_m, ring_m]) @ axis for axis in (right, np.array([0.0, 0.0, 1.0])))
    x = np.round((across_m - qpos[:3] @ right) / _METRES_PER_DOT).astype(int) + COLUMNS
    y = 4 * ROWS - 1 - np.round(up_m / _METRES_PER_DOT).astype(int)
    inside = (x >= 0) & (x < 2 * COLUMNS) & (y >= 0) & (y < 4 * ROWS)
    dots = np.zeros((4 * ROWS, 2 * COLUMNS), dtype=bool)
    dots[y[inside], x[inside]] = True
    cells = dots.reshape(ROWS, 4, COLUMNS, 2).transpose(0, 2, 1, 3)
    bits = np.sum(cells * _DOT_BITS, axis=(2, 3))
    return ["".join(chr(0x2800 + int(bit)) if bit else " " for bit in row) for row in bits]
