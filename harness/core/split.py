"""What a method may learn from: splits (docs/notes/traps.md F1), and training data that it declares.

A test clip is never among its examples. Whoever reads a rank must know whether the method may have seen the test clips
elsewhere: it declares its `training_data`, "examples" if it learns from the examples of a run alone, "none" if it
learns nothing, else the names of outside data, such as "AMASS". A method without the attribute is listed and ranked
with the note "training data unknown". Results of versions that did not store it have no note.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from harness.errors import BadInput

Split = Literal["block", "sequence", "subject"]
StatisticalUnit = Literal["performer", "clip"]
"""What statistics count (see `harness.compare.units`)."""

GUARD_S = 1.0
"""No example frame lies within this time of a tested block [s]."""


class ExampleLeak(BadInput):
    """A test clip among its own examples, under whatever name; it ends the whole run."""


@dataclass(frozen=True)
class ClipPart:
    """A clip, or the part of it from `start` to `end`, as shares of its length."""

    clip: str
    start: float = 0.0
    end: float = 1.0

    @classmethod
    def parse(cls, text: str) -> "ClipPart":
        """Parse "13_17" or "13_17@0.20-0.40"; BadInput for another form."""
        clip, at, share = text.partition("@")
        if not at:
            return cls(text)
        match = re.fullmatch(r"([01]?\.?\d*)-([01]?\.?\d*)", share)
        try:
            start, end = (float(x) for x in match.groups()) if match else (1.0, 0.0)
        except ValueError:
            start, end = 1.0, 0.0
        if not 0.0 <= start < end <= 1.0:
            raise BadInput(f"{text!r} is not a part of a clip.", "Write it as CLIP@0.20-0.40, in shares of the take.")
        return cls(clip, start, end)

    def __str__(self) -> str:
        """The text that `parse` reads; different parts have different texts."""
        complete = (self.start, self.end) == (0.0, 1.0)
        return self.clip if complete else f"{self.clip}@{_format_share(self.start)}-{_format_share(self.end)}"

    def frames(self, count: int) -> range:
        """The frames of the part, in a take of `count` frames."""
        return range(round(self.start * count), round(self.end * count))


def performer_of(clip: str) -> str | None:
    """The performer that a clip's name tells: "p1" of walking_p1_01, "13" of CMU's 13_17; None for other names."""
    match = re.fullmatch(r"\w+_(p\d+)_\d+|(\d+)_\d+", clip)
    return (match[1] or match[2]) if match else None


def _format_share(share: float) -> str:
    """A share with two decimals, or more if it needs more."""
    short = f"{share:.2f}"
    return short if float(short) == share else np.format_float_positional(share)


def select_examples(test: ClipPart, candidates: Iterable[str], split: Split, subjects: dict[str, str]) -> list[str]:
    """The candidate clips that the split allows as examples, sorted; for `block` with the test clip itself.

    Clips at several places of a library that CMU's subject and trial name alike are one take.
    """
    others = {name for name in candidates if _take(name) != _take(test.clip)}
    match split:
        case "block":
            return sorted({*others, test.clip})
        case "sequence":
            return sorted(others)
        case "subject":
            return sorted({name for name in candidates if subjects[name] != subjects[test.clip]})


def _take(clip: str) -> str:
    """The take of a clip: CMU's subject and trial, wherever the file lies, else the clip's name."""
    last = clip.rpartition("/")[2]
    return last if re.fullmatch(r"\d+_\d+", last) else clip


def forbidden_frames(test: ClipPart, split: Split, count: int, rate_hz: float) -> range:
    """The frames of the test take whose motion no example may contain: with `block` the part and its guard, else all.

    `count` and `rate_hz` are the take's number of frames and frame rate.
    """
    if split != "block":
        return range(count)
    frames, guard = test.frames(count), round(GUARD_S * rate_hz)
    return range(max(frames.start - guard, 0), min(frames.stop + guard, count))


def allowed_frames(held_out: Iterable[ClipPart], example: str, count: int, rate_hz: float) -> list[range]:
    """The runs of frames of an example that a method may learn from: all but held-out parts and their guard time.

    `count` and `rate_hz` are the example's number of frames and frame rate. A clip that is held out completely gives no
    frames, whatever the split.
    """
    guard, first, runs = round(GUARD_S * rate_hz), 0, []
    for frames_out in sorted(
        (p.frames(count) for p in held_out if p.clip == example), key=lambda frames_out: frames_out.start
    ):
        runs.append(range(first, frames_out.start - guard))
        first = max(first, frames_out.stop + guard)
    return [run for run in (*runs, range(first, count)) if len(run) > 1]


def refuse_leak(held_out: Iterable[ClipPart], example: str, runs: Iterable[range], count: int, rate_hz: float) -> None:
    """Raise ExampleLeak if a run of example frames reaches into a held-out part of the example or its guard time."""
    guard, used = GUARD_S * rate_hz, list(runs)
    for part in held_out:
        frames_out = part.frames(count)
        for run in used if part.clip == example else ():
            if run.start < frames_out.stop + guard - 0.5 and run.stop > frames_out.start - guard + 0.5:
                raise ExampleLeak(
                    f"{part} is tested or withheld, but frames {run.start} to {run.stop} of that take are examples.",
                    "A test clip can never be among its own examples: remove it, or use split block with a part.",
                )


EXAMPLES, NONE, UNKNOWN = "examples", "none", "unknown"


def declared_training_data(method: object) -> str:
    """What a method declares; `UNKNOWN` without a declaration. BadInput for another declaration than a text."""
    text = getattr(method, "training_data", UNKNOWN)
    if not isinstance(text, str) or not text.strip():
        raise BadInput(f"training_data is {text!r}.", f"It must be a text such as {EXAMPLES!r}, {NONE!r} or 'AMASS'.")
    return text.strip()


def training_note(declared: str | None) -> str:
    """The note beside a method's name and rank: "" where it learns from the examples at most, or nothing was stored."""
    if declared in (None, EXAMPLES, NONE):
        return ""
    return "training data unknown" if declared == UNKNOWN else f"trained on {declared}"
