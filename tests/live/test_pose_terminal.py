"""The guided poses on a terminal: figures, meter, and what stays on the screen."""

import io
import os
from dataclasses import replace

import numpy as np
import pytest

from harness.body import tpose
from harness.calibrate import POSES, GuidedPose, PerformerPose, pose_configuration
from harness.core.humanoid24 import standard_skeleton
from harness.live.pose_terminal import COLUMNS, ROWS, PoseTerminal, draw_figure, guided_lines

OWN = standard_skeleton()
TARGET = pose_configuration(POSES[0], OWN)
GUIDED = GuidedPose(1, TARGET, PerformerPose(TARGET, np.array([0.02, 0.07])), "right_hand", 1.35, "hold still")


class Terminal(io.StringIO):
    """A text stream that says that it is a terminal."""

    encoding = "utf-8"

    def isatty(self) -> bool:
        return True


def screen(text: str) -> list[str]:
    """Lines on the screen after the text: what a terminal does with CR, LF, cursor up, and both ways of erasing."""
    lines, row, column, i = [""], 0, 0, 0
    while i < len(text):
        if text.startswith("\033[", i):
            end = next(k for k in range(i + 2, len(text)) if text[k].isalpha())
            count, kind = int(text[i + 2 : end] or 0), text[end]
            if kind == "A":
                row -= count
            else:
                lines[row] = lines[row][:column]
                lines = lines[: row + 1] if kind == "J" else lines
            i = end + 1
            continue
        if text[i] == "\n":
            row, column = row + 1, 0
            lines += [""] * (row + 1 - len(lines))
        elif text[i] == "\r":
            column = 0
        else:
            lines[row] = lines[row][:column].ljust(column) + text[i] + lines[row][column + 1 :]
            column += 1
        i += 1
    return lines


def dots(lines: list[str]) -> np.ndarray:
    """(R, C) number of dots of each character."""
    rows = [line.ljust(COLUMNS) for line in lines]
    return np.array([[(ord(c) - 0x2800).bit_count() if c != " " else 0 for c in row] for row in rows])


def test_a_figure_has_arms_where_the_pose_has_them() -> None:
    """In T-pose both arms are out; a raised left leg is on the right of the picture, which is seen from the front."""
    straight, leg_up = (dots(draw_figure(q, OWN)) for q in (tpose(OWN), pose_configuration(POSES[4], OWN)))
    assert straight.shape == (ROWS, COLUMNS)
    wide = np.flatnonzero(straight.any(axis=0))
    assert wide[0] < COLUMNS / 2 - 6
    assert wide[-1] > COLUMNS / 2 + 4
    middle = COLUMNS // 2
    legs = slice(2 * ROWS // 3, ROWS)
    assert leg_up[legs, middle + 2 :].sum() > 5
    assert leg_up[legs, : middle - 2].sum() == 0
    assert straight[legs, middle + 4 :].sum() == 0


def test_the_meter_and_the_words() -> None:
    lines = guided_lines(GUIDED, OWN, figures=False)
    assert lines == [
        "still [############............] 1.4 of 2.7 s; right_hand is 7 cm from its place in the pose",
    ]
    moving = replace(GUIDED, still_s=0.0, performer=None)
    assert guided_lines(moving, OWN, figures=False) == [
        "still [........................] 0.0 of 2.7 s; waiting for all stations",
        "hold still",
    ]
    full = replace(GUIDED, still_s=2.7, message="hold still: station 'head' was silent")
    assert guided_lines(full, OWN, figures=False) == [
        "still [########################] 2.7 of 2.7 s; right_hand is 7 cm from its place in the pose",
        "hold still: station 'head' was silent",
    ]
    pair = guided_lines(GUIDED, OWN, figures=True)
    assert pair[0].split() == ["pose", "1", "you"]
    assert len(pair) == ROWS + 2
    assert [line[:COLUMNS].rstrip() for line in pair[1 : ROWS + 1]] == [
        line[COLUMNS + 2 :] for line in pair[1 : ROWS + 1]
    ]


def test_the_block_is_replaced_and_leaves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines that others print stay above it; after the end there are only those."""
    monkeypatch.setattr("shutil.get_terminal_size", lambda **_: os.terminal_size((100, 40)))
    stream = Terminal()
    terminal = PoseTerminal(OWN, stream)
    terminal.show(GUIDED)
    terminal.show(replace(GUIDED, still_s=0.3))
    assert len(screen(stream.getvalue())) == ROWS + 3
    stream.write("\rpose 1 of 8 taken\033[K\n")  # as `print_status` prints
    terminal.show(replace(GUIDED, number=2))
    seen = screen(stream.getvalue())
    assert seen[0] == "pose 1 of 8 taken"
    assert seen[1].split() == ["pose", "2", "you"]
    assert len(seen) == ROWS + 3
    terminal.close()
    assert screen(stream.getvalue()) == ["pose 1 of 8 taken", ""]


@pytest.mark.parametrize(("columns", "rows"), [(50, 40), (100, 12)])
def test_a_small_terminal_gets_the_meter(columns: int, rows: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shutil.get_terminal_size", lambda **_: os.terminal_size((columns, rows)))
    stream = Terminal()
    PoseTerminal(OWN, stream).show(GUIDED)
    (line,) = screen(stream.getvalue())
    assert line.startswith("still [####")
    assert len(line) < columns


def test_a_file_gets_nothing() -> None:
    stream = io.StringIO()
    terminal = PoseTerminal(OWN, stream)
    terminal.show(GUIDED)
    terminal.close()
    assert stream.getvalue() == ""
