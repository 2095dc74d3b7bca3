"""Subsets of a database by the share of its frames, drawn by seed: each is contained in every larger one."""

from collections.abc import Sequence

import numpy as np

from harness.core.motion import BodyMotion
from harness.core.seeds import generator
from harness.errors import BadInput

PIECE_S = 0.5
"""Length of the pieces that are drawn [s]: methods need consecutive frames (choice)."""


def keep_share(takes: Sequence[BodyMotion], share: float, seed: int) -> list[BodyMotion]:
    """Keep about `share` (0 to 1) of the frames of all takes, in pieces of `PIECE_S` that are drawn by `seed`.

    Each piece has a draw of its own, by its take and place, and the smallest draws are kept until the share is reached.
    Subsets of one seed are therefore nested. Neighbouring pieces stay together. A share of 1 keeps everything.
    BadInput for a share outside (0, 1].
    """
    if not 0.0 < share <= 1.0:
        raise BadInput(f"motion.example_share = {share} is not a share.", "Write a number above 0, and at most 1.")
    if share == 1.0 or not takes:
        return list(takes)
    pieces = [
        (generator(seed, "example share", take.name, at, start).random(), at, start, stop)
        for at, take in enumerate(takes)
        for start, stop in _piece_ends(take)
    ]
    missing, kept = share * sum(map(len, takes)), list[tuple[int, int, int]]()
    for _, at, start, stop in sorted(pieces):
        if missing <= 0.0:
            break
        kept.append((at, start, stop))
        missing -= stop - start
    return [_cut(takes[at], start, stop) for at, start, stop in _joined(sorted(kept))]


def _piece_ends(take: BodyMotion) -> list[tuple[int, int]]:
    """First and end frame of each piece of a take; the last one takes up the rest."""
    length = max(round(PIECE_S * take.rate_hz), 1)
    count = max(len(take) // length, 1)
    ends = [*(length * np.arange(1, count)).tolist(), len(take)]
    return list(zip([0, *ends[:-1]], ends, strict=True))


def _joined(pieces: Sequence[tuple[int, int, int]]) -> list[tuple[int, int, int]]:
    """The pieces with neighbours of one take joined."""
    joined: list[tuple[int, int, int]] = []
    for at, start, stop in pieces:
        if joined and joined[-1][0] == at and joined[-1][2] == start:
            start = joined.pop()[1]
        joined.append((at, start, stop))
    return joined


def _cut(take: BodyMotion, start: int, stop: int) -> BodyMotion:
    return BodyMotion(take.name, take.subject, take.source, take.behaviour, take.rate_hz, take.qpos[start:stop])
