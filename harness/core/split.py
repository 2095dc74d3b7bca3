"""Which motion may be learnt from: a test clip is never among its own examples (docs/methods.md F1)."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from harness.errors import BadInput

Split = Literal["block", "sequence", "subject"]

GUARD_S = 1.0
"""No example frame lies within this time of a tested block [s]."""


@dataclass(frozen=True)
class ClipPart:
    """A clip, or the share of it from `start` to `end`."""

    clip: str
    start: float = 0.0
    end: float = 1.0

    @classmethod
    def parse(cls, text: str) -> "ClipPart":
        """From "13_17" or "13_17@0.20-0.40"."""
        clip, at, share = text.partition("@")
        if not at:
            return cls(text)
        found = re.fullmatch(r"([01]?\.?\d*)-([01]?\.?\d*)", share)
        try:
            start, end = (float(x) for x in found.groups()) if found else (1.0, 0.0)
        except ValueError:
            start, end = 1.0, 0.0
        if not 0.0 <= start < end <= 1.0:
            raise BadInput(f"{text!r} is no part of a clip.", "Write it as CLIP@0.20-0.40, shares of the take.")
        return cls(clip, start, end)

    def __str__(self) -> str:
        """As `parse` reads it; parts that differ at all print differently."""
        whole = (self.start, self.end) == (0.0, 1.0)
        return self.clip if whole else f"{self.clip}@{_text(self.start)}-{_text(self.end)}"

    def frames(self, count: int) -> range:
        """The frames of a take of `count` frames that lie in it."""
        return range(round(self.start * count), round(self.end * count))


def _text(share: float) -> str:
    """At least two decimals, and as many as it takes."""
    short = f"{share:.2f}"
    return short if float(short) == share else np.format_float_positional(share)


def select_examples(test: ClipPart, candidates: Iterable[str], split: Split, subjects: dict[str, str]) -> list[str]:
    """The candidate clips that the split lets a method see; for `block` the test clip itself is among them."""
    match split:
        case "block":
            return sorted({*candidates, test.clip})
        case "sequence":
            return sorted({name for name in candidates if name != test.clip})
        case "subject":
            return sorted({name for name in candidates if subjects[name] != subjects[test.clip]})


def allowed_frames(closed: Iterable[ClipPart], example: str, count: int, rate_hz: float) -> list[range]:
    """The runs of frames of an example that may be learnt from: all, but for the closed parts and their guard time.

    A clip that is closed whole gives nothing, whatever the split.
    """
    guard, first, runs = round(GUARD_S * rate_hz), 0, []
    for shut in sorted((p.frames(count) for p in closed if p.clip == example), key=lambda shut: shut.start):
        runs.append(range(first, shut.start - guard))
        first = max(first, shut.stop + guard)
    return [run for run in (*runs, range(first, count)) if len(run) > 1]


def refuse_leak(closed: Iterable[ClipPart], example: str, runs: Iterable[range], count: int, rate_hz: float) -> None:
    """BadInput when any frame that is learnt from lies in a closed part of the example or in the guard time of it."""
    guard, used = GUARD_S * rate_hz, list(runs)
    for part in closed:
        shut = part.frames(count)
        for run in used if part.clip == example else ():
            if run.start < shut.stop + guard - 0.5 and run.stop > shut.start - guard + 0.5:
                raise BadInput(
                    f"{part} is judged or withheld, but frames {run.start} to {run.stop} of that take are examples.",
                    "A test clip can never be among its own examples: remove it, or use split block with a part.",
                )
