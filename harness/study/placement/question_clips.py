"""The clips of a question: the pool on which sets are chosen, the held-out clips, and the examples of methods.

Built-in motion has a fixed pool of 48 performers, and 32 others who are held out. Methods learn from a take of each of
16 further performers and, where they may know the performer, from another take of the one who is tested. So examples
are equally many for all, and few enough to be loaded by every worker. A library's takes are dealt to the three uses.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

from harness.compare import Sampling
from harness.errors import BadInput, UnknownName
from harness.mocap import MotionSource, synthetic

Split = Literal["sequence", "subject"]
_LISTED = synthetic.performer_names()
EXAMPLE_PERFORMERS = (*_LISTED[:8], *_LISTED[-8:])
"""Performers whom methods learn from, of both kinds of style."""
POOL_PERFORMERS = _LISTED[8:-8]
HELD_OUT_PERFORMERS, FRESH_PERFORMERS = synthetic.UNLISTED_PERFORMERS[:32], synthetic.UNLISTED_PERFORMERS[32:]
"""Performers on whom the chosen sets are tested, and performers whom no question uses (`tests.placement_questions`)."""
_TESTED, _LEARNT = 1, 3
"""Takes of a built-in performer that are tested and learnt from."""
_ROLES, _MOST_TAKES = 3, 4
"""Uses that the takes of a library are dealt to; most takes of a performer and a behaviour that are tested [choice]."""
HELD_OUT_CLIPS = 32
"""Most held-out clips of each behaviour of a library."""

Units = Mapping[str, tuple[str, ...]]
"""Unit of statistics (see `compare.units`) -> its clips, in the order in which units are used."""


@dataclass(frozen=True)
class QuestionClips:
    """Names of clips by use."""

    pool: Units
    held_out: Units
    examples: tuple[str, ...]
    """Clips that methods may learn from, as far as the split allows."""
    own_examples: Units
    """Unit -> clips that only its own tests learn from."""
    note: str = ""

    @property
    def test(self) -> tuple[str, ...]:
        """All clips of the pool."""
        return tuple(clip for clips in self.pool.values() for clip in clips)


def builtin_clips(behaviours: Sequence[str], source: MotionSource, *, split: Split, most: int) -> QuestionClips:
    """The clips of the motion generator: every performer does every behaviour once; `most` limits the pool, 0 does not.

    UnknownName for a behaviour, BadInput for more clips than there are performers.
    """
    for behaviour in behaviours:
        if behaviour not in synthetic.BEHAVIOURS:
            raise UnknownName("behaviour", behaviour, synthetic.BEHAVIOURS)
    if most > len(POOL_PERFORMERS):
        raise BadInput(f"{most} clips of {len(POOL_PERFORMERS)} to choose on.", f"Ask for {len(POOL_PERFORMERS)}.")
    pool = builtin_units(POOL_PERFORMERS[: most or None], behaviours)
    held_out = builtin_units(HELD_OUT_PERFORMERS, behaviours)
    givers = [behaviours[at % len(behaviours)] for at in range(len(EXAMPLE_PERFORMERS))]
    examples = [_take(behaviour, who, _LEARNT) for behaviour, who in zip(givers, EXAMPLE_PERFORMERS, strict=True)]
    known = own_examples(behaviours) if split == "sequence" else {}
    return QuestionClips(pool, held_out, tuple(examples), known)


def builtin_units(performers: Sequence[str], behaviours: Sequence[str]) -> Units:
    """Each of these performers with a take of each behaviour."""
    return {f"performer {who}": tuple(_take(b, who, _TESTED) for b in behaviours) for who in performers}


def own_examples(behaviours: Sequence[str]) -> Units:
    """Each tested performer with another take of each behaviour."""
    tested = (*POOL_PERFORMERS, *synthetic.UNLISTED_PERFORMERS)
    return {f"performer {who}": tuple(_take(b, who, _LEARNT) for b in behaviours) for who in tested}


def _take(behaviour: str, performer: str, number: int) -> str:
    return f"{behaviour}_{performer}_{number:02d}"


def library_clips(behaviours: Sequence[str], source: MotionSource, *, split: Split, most: int) -> QuestionClips:
    """The clips of a library: each performer's takes are dealt in turn to choose on, to hold out and to learn from.

    `most` limits the clips of each behaviour to choose on, 0 those of each performer. UnknownName for a behaviour,
    BadInput for one with too few clips, and where no other performer is there to learn from.
    """
    dealt = [_deal(behaviour, source) for behaviour in behaviours]
    fewest = min(sum(map(len, chosen.values())) for chosen, _, _ in dealt)
    if most > fewest:
        raise BadInput(f"{most} clips of {fewest} to choose on.", f"Ask for {fewest} clips or fewer.")
    pool = _units([_take_turns(chosen, most) for chosen, _, _ in dealt], source)
    held_out = _units([_take_turns(tested, HELD_OUT_CLIPS) for _, tested, _ in dealt], source)
    examples = tuple(clip for _, _, learnt in dealt for clips in learnt.values() for clip in clips)
    teachers = {source.subject(clip) for clip in examples}
    tested = {source.subject(clip) for units in (pool, held_out) for clips in units.values() for clip in clips}
    if split == "subject" and any(teachers <= {who} for who in tested):
        raise BadInput("--split subject: all examples are of one performer.", "Leave it out, or add other performers.")
    new = len(tested - teachers) if split == "sequence" else 0
    note = f"Methods learnt from no other take of {new} of {len(tested)} performers." if new else ""
    return QuestionClips(pool, held_out, examples, {}, note)


def _deal(behaviour: str, source: MotionSource) -> tuple[dict[str, list[str]], ...]:
    """Performer -> takes, for each of the three uses; performers alternate."""
    by_subject: dict[str, list[str]] = {}
    for name in source.names():
        if source.behaviour(name) == behaviour:
            by_subject.setdefault(source.subject(name), []).append(name)
    if not by_subject:
        raise UnknownName("behaviour", behaviour, dict.fromkeys(filter(None, map(source.behaviour, source.names()))))
    dealt: tuple[dict[str, list[str]], ...] = ({}, {}, {})
    takes = [(subject, name) for subject, names in by_subject.items() for name in names]
    for at, (subject, name) in enumerate(takes):
        dealt[at % _ROLES].setdefault(subject, []).append(name)
    if not all(dealt):
        advice = "Three are needed: to choose on, to test, to learn from."
        raise BadInput(f"{behaviour} has {len(takes)} clips.", advice)
    return dealt


def _take_turns(by_performer: Mapping[str, Sequence[str]], most: int) -> list[str]:
    """The first takes of all performers, then their second ones: at most `most`, by default a few of each."""
    clips = list(_interleave(list(by_performer.values())))
    return clips[:most] if most else list(_interleave([takes[:_MOST_TAKES] for takes in by_performer.values()]))


def _interleave(lists: Sequence[Sequence[str]]) -> Iterator[str]:
    """The items of several lists in turn."""
    for at in range(max(map(len, lists))):
        yield from (items[at] for items in lists if at < len(items))


def _units(clips: Collection[Sequence[str]], source: MotionSource) -> Units:
    """The clips of several behaviours by unit, in the order of their first clips."""
    names = [name for of_behaviour in clips for name in of_behaviour]
    sampling = Sampling({name: known for name in names if (known := source.performer(name))})
    units: dict[str, tuple[str, ...]] = {}
    for name in names:
        unit = sampling.unit_of(name)
        units[unit] = (*units.get(unit, ()), name)
    return units
