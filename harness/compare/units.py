"""Units of statistics. Clips of one performer are not independent, so that what counts is a performer.

A clip whose performer is not known is a unit with the other parts of its take. A scenario whose clips come from too few
performers may declare `unit = "clip"`. Its statements then hold for these performers only.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.core.number_format import count_noun
from harness.core.split import StatisticalUnit, performer_of

_PERFORMER, _CLIP = "performer ", ", clip "


@dataclass(frozen=True)
class Sampling:
    """What the statistics of a run count: the performers of its clips, or the clips."""

    performers: Mapping[str, str] | None = None
    """Take -> its performer, where known (see `results.manifest.Manifest`). With None the name of a take tells it, if
    it is one of CMU's or of the motion generator's."""
    unit: StatisticalUnit = "performer"

    @classmethod
    def of_summary(cls, summary: Mapping[str, Any]) -> "Sampling":
        """The sampling of a run, from its summary.json."""
        return cls(summary.get("performers"), summary.get("unit", "performer"))

    def unit_of(self, clip: str) -> str:
        """The unit of a clip, which may be a part and have a scenario before it ("demo: 13_17@0.20-0.40")."""
        take = clip.rpartition(": ")[2].partition("@")[0]
        performer = performer_of(take) if self.performers is None else self.performers.get(take)
        owner = take if performer is None else f"{_PERFORMER}{performer}"
        return f"{owner}{_CLIP}{clip}" if self.unit == "clip" else owner


BY_NAME = Sampling()
"""Performers are the units, and the names of the clips tell them."""


def average_units(values: Mapping[str, float], sampling: Sampling = BY_NAME) -> dict[str, float]:
    """Unit -> mean of the values of its clips, sorted by unit."""
    of_unit: dict[str, list[float]] = {}
    for clip, value in values.items():
        of_unit.setdefault(sampling.unit_of(clip), []).append(value)
    return {unit: float(np.mean(of_unit[unit])) for unit in sorted(of_unit)}


def count_units(units: Iterable[str]) -> str:
    """The number of units in words: "12 performers", "3 takes", or "9 units" of both kinds.

    Clips are counted with those who performed them: "18 clips of 3 performers, these performers only".
    """
    names = set(units)
    owners = {name.partition(_CLIP)[0] for name in names}
    known = sum(name.startswith(_PERFORMER) for name in owners)
    noun = "take" if not known else "performer" if known == len(owners) else "unit"
    counted = count_noun(len(owners), noun)
    if not any(_CLIP in name for name in names):
        return counted
    only = f"this {noun}" if len(owners) == 1 else f"these {noun}s"
    return f"{count_noun(len(names), 'clip')} of {counted}, {only} only"


def count_clips(clips: Iterable[str], sampling: Sampling = BY_NAME, noun: str = "clip") -> str:
    """The numbers of clips and of units in words, such as "15 clips of 3 performers"; `noun` is that of a clip."""
    names = sorted(set(clips))
    units = count_units(sampling.unit_of(clip) for clip in names)
    if sampling.unit == "clip":
        return units.replace("clip", noun, 1)
    return count_noun(len(names), noun) + ("" if units == count_noun(len(names), "take") else f" of {units}")
