"""Parser of the text of a BVH file: a tree of joints, then frames of numbers, checked line by line."""

import re
from dataclasses import dataclass
from pathlib import Path

from harness.errors import BadFile
from harness.mocap.read.file_checks import check_last_line, parse_number, parse_numbers, read_lines

LIMIT_BYTES = 64 * 2**20
"""Largest BVH file that is read: about 80,000 frames of CMU's skeleton, which need ten times that in memory."""
MAX_JOINTS = 1000

_FORMAT = "a BVH motion"
_LIVE_COUNT = re.compile(r"Frames:  +\d+")
"""The count of a live output, which is padded to be overwritten in place."""
_ROTATIONS = {"Xrotation", "Yrotation", "Zrotation"}
_POSITIONS = {"Xposition", "Yposition", "Zposition"}


@dataclass(frozen=True)
class BvhJoint:
    """A joint, or an End Site, which has no channels."""

    name: str
    parent: int
    """Index of the parent; -1 for the root."""
    offset: tuple[float, ...]
    """Offset from the parent [the file's unit]."""
    channels: tuple[str, ...]


@dataclass(frozen=True)
class BvhText:
    """The contents of a checked BVH file."""

    joints: tuple[BvhJoint, ...]
    """Joints and End Sites, parents before children, as in the file."""
    frame_time_s: float
    frames: tuple[str, ...]
    """One line of numbers per frame."""
    notes: tuple[str, ...] = ()
    """What was left out, a sentence each."""

    def canonical(self) -> str:
        """The motion as simple BVH text: one keyword per line, plain names, no End Sites, no blank lines."""
        lines = ["HIERARCHY"]
        chain: list[int] = []
        for j, joint in enumerate(self.joints):
            if not joint.channels:
                continue
            while chain and chain[-1] != joint.parent:
                chain.pop()
                lines.append("}")
            chain.append(j)
            lines += [f"{'ROOT' if joint.parent < 0 else 'JOINT'} j{j}", "{"]
            lines.append("OFFSET " + " ".join(map(repr, joint.offset)))
            lines.append(f"CHANNELS {len(joint.channels)} " + " ".join(joint.channels))
        lines += ["}"] * len(chain)
        lines += ["MOTION", f"Frames: {len(self.frames)}", f"Frame Time: {self.frame_time_s!r}", *self.frames]
        return "\n".join(lines) + "\n"


def parse_bvh(path: Path) -> BvhText:
    """Read and check a BVH file; BadFile with the line of the first error.

    Of a live output whose process was killed (`harness.live.file_outputs`), the whole lines after the last save are
    frames too.
    """
    all_lines = read_lines(path, _FORMAT, LIMIT_BYTES)
    lines = [(line, text.split()) for line, text in enumerate(all_lines, start=1) if text.strip()]
    motion = next((k for k, (_, words) in enumerate(lines) if words == ["MOTION"]), None)
    if motion is None:
        raise BadFile(path, "no line MOTION", _FORMAT, "Is the file complete, and BVH?")
    joints = _parse_joints(_TokenReader(path, lines[: motion + 1]))
    in_motion, notes = lines[motion + 1 :], list[str]()
    if in_motion and _LIVE_COUNT.fullmatch(all_lines[in_motion[0][0] - 1]) and in_motion[0][1][1].isdecimal():
        in_motion, notes = _end_live_output(in_motion, cut=all_lines[-1] != "")
    if not notes:
        check_last_line(path)
    frame_time_s, frames = _parse_frames(path, in_motion, sum(len(joint.channels) for joint in joints))
    return BvhText(joints, frame_time_s, frames, tuple(notes))


def _end_live_output(lines: list[tuple[int, list[str]]], *, cut: bool) -> tuple[list[tuple[int, list[str]]], list[str]]:
    """The lines after MOTION with the number of frames that a killed process wrote, and a note if it was killed.

    `cut` is whether the last line has no end; it is left out if it is not one of the announced frames.
    """
    announced = int(lines[0][1][1])
    written = len(lines) - 2
    if written <= announced:
        return lines, []
    frames = written - cut
    note = f"the program that wrote the file was killed: {announced} frames are announced, {frames} are whole"
    return [(lines[0][0], ["Frames:", str(frames)]), *lines[1 : 2 + frames]], [note]


class _TokenReader:
    """The tokens of the hierarchy, with braces as tokens of their own; the last one is MOTION."""

    def __init__(self, path: Path, lines: list[tuple[int, list[str]]]) -> None:
        self.path = path
        self.line, self.word = 0, ""
        self._rest = (
            (line, word)
            for line, words in lines
            for word in " ".join(words).replace("{", " { ").replace("}", " } ").split()
        )

    def next(self) -> str:
        """The next token; MOTION at the end."""
        self.line, self.word = next(self._rest, (self.line, "MOTION"))
        return self.word

    def expect(self, *tokens: str) -> None:
        """Read these tokens; BadFile for others."""
        for token in tokens:
            if self.next() != token:
                raise self.unexpected(token)

    def triple(self, what: str) -> tuple[float, ...]:
        return tuple(parse_number(self.path, self.next(), what, self.line) for _ in range(3))

    def unexpected(self, expected: str) -> BadFile:
        """The error for the last token, which is not the expected one."""
        return BadFile(self.path, f"{self.word[:40]!r}", expected, "Is the file complete, and BVH?", self.line)


def _parse_joints(words: _TokenReader) -> tuple[BvhJoint, ...]:
    joints: list[BvhJoint] = []
    names: set[str] = set()
    inside: list[int] = []
    words.expect("HIERARCHY")
    while words.next() != "MOTION" or inside or not joints:
        kind = words.word
        if kind == "}" and inside:
            inside.pop()
            continue
        root = kind == "ROOT" and not joints
        if not root and not (kind in ("JOINT", "End") and inside and joints[inside[-1]].channels):
            raise words.unexpected("JOINT, End Site or }" if inside else "one ROOT with its joints, then MOTION")
        name = words.next() if kind != "End" else f"{joints[inside[-1]].name}_end"
        if kind == "End":
            words.expect("Site")
        if name in names or name in ("{", "}", "MOTION") or len(joints) == MAX_JOINTS:
            raise words.unexpected(f"a new name, and at most {MAX_JOINTS} joints")
        names.add(name)
        words.expect("{", "OFFSET")
        offset = words.triple(f"the offset of {name}")
        channels = () if kind == "End" else _parse_channels(words, root)
        joints.append(BvhJoint(name, inside[-1] if inside else -1, offset, channels))
        inside.append(len(joints) - 1)
    return tuple(joints)


def _parse_channels(words: _TokenReader, root: bool) -> tuple[str, ...]:
    """The channels of a joint: three rotations; for the root, three positions before them."""
    count = 6 if root else 3
    words.expect("CHANNELS", str(count))
    channels = tuple(words.next() for _ in range(count))
    if set(channels[-3:]) != _ROTATIONS or (root and set(channels[:3]) != _POSITIONS):
        words.word = " ".join(channels)
        raise words.unexpected("each rotation once" + (" after each position once" if root else ""))
    return channels


def _parse_frames(path: Path, lines: list[tuple[int, list[str]]], width: int) -> tuple[float, tuple[str, ...]]:
    """Frame time [s] and the lines of the frames; BadFile unless number and `width` agree with the header."""
    last = lines[-1][0] if lines else None
    if len(lines) < 2 or lines[0][1][0] != "Frames:" or lines[1][1][:2] != ["Frame", "Time:"]:
        raise BadFile(path, "no frame count and time", "Frames: and Frame Time: after MOTION", "Is it complete?", last)
    (count,) = parse_numbers(path, lines[0][1][1:], 1, "the frame count", lines[0][0])
    (frame_time_s,) = parse_numbers(path, lines[1][1][2:], 1, "the frame time", lines[1][0])
    if not 1e-5 < frame_time_s < 10.0:
        raise BadFile(path, f"a frame time of {frame_time_s:g} s", "1e-5 to 10 s", "Correct it.", lines[1][0])
    frames = lines[2:]
    if not frames or len(frames) != count:
        advice = "The file is truncated; fetch it again." if len(frames) < count else "Correct the frame count."
        raise BadFile(path, f"{len(frames)} frames", f"the {count:g} announced, at least 1", advice, last)
    for line, words in frames:
        parse_numbers(path, words, width, "a frame", line)
    return frame_time_s, tuple(" ".join(words) for _, words in frames)
