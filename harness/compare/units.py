"""Units of statistics. Clips of one performer are not independent, so that what counts is a performer.

A clip whose performer is not known is a unit with the other parts of its take.
"""

from collections.abc import Iterable, Mapping

import numpy as np

from harness.core.number_format import count_noun
from harness.core.split import performer_of

Performers = Mapping[str, str]
"""Clip -> its performer, where known (see `results.manifest.Manifest`)."""


def unit_of(clip: str, performers: Performers | None = None) -> str:
    """The unit of a clip, which may be a part and have a scenario before it ("demo: 13_17@0.20-0.40").

    With `performers` None the clip's name tells the performer, if it is one of CMU's or of the motion generator's.
    """
    take = clip.rpartition(": ")[2].partition("@")[0]
    performer = performer_of(take) if performers is None else performers.get(take)
    return take if performer is None else f"performer {performer}"


def average_units(values: Mapping[str, float], performers: Performers | None = None) -> dict[str, float]:
    """Unit -> mean of the values of its clips, sorted by unit."""
    of_unit: dict[str, list[float]] = {}
    for clip, value in values.items():
        of_unit.setdefault(unit_of(clip, performers), []).append(value)
    return {unit: float(np.mean(of_unit[unit])) for unit in sorted(of_unit)}


def count_units(units: Iterable[str]) -> str:
    """The number of units in words: "12 performers", "3 takes", or "9 units" of both kinds."""
    names = set(units)
    known = sum(name.startswith("performer ") for name in names)
    return count_noun(len(names), "take" if not known else "performer" if known == len(names) else "unit")


def count_clips(clips: Iterable[str], performers: Performers | None = None, noun: str = "clip") -> str:
    """The numbers of clips and of units in words, such as "15 clips of 3 performers"; `noun` is that of a clip."""
    names = sorted(set(clips))
    units = count_units(unit_of(clip, performers) for clip in names)
    return count_noun(len(names), noun) + ("" if units == count_noun(len(names), "take") else f" of {units}")
