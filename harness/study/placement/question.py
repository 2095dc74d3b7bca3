"""A placement study from a question: how many stations for which behaviour, without a file.

    harness placement --stations 3 --behaviour table_tennis

Sets are chosen on some clips of the behaviours, tested on others, and methods learn from a third part. Clips to choose
on are of as many performers as there are, since a performer is the unit of statistics. The budget of time decides how
sets are searched and on how many clips: see `plan_within_budget`.
"""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from harness.body import select_places
from harness.compare import count_needed
from harness.core.ranges import Name
from harness.errors import BadInput, UnknownName
from harness.experiment.scenarios import Scenario, ScenarioMotion, Station
from harness.mocap import LibraryFolders, MotionSource, open_motion_source
from harness.results.findings.advice import Effort
from harness.simulate import TrackerConfig
from harness.simulate.physics import ConstellationSettings, Physics, load_constellation
from harness.study.placement.candidates import Candidate
from harness.study.placement.config import MAX_STATIONS, ExhaustiveOptions, GreedyOptions, PlacementStudy

DEFAULT_METHOD = "expert_map"
DEFAULT_MINUTES = 10.0
DEFAULT_CLIPS = 16
"""Clips on which sets are chosen, by default: three more than 165 sets of three need (see `power`)."""
LEAST_CLIPS = 6
CLIP_S = 5.0
"""Length of each clip that is used [s]."""
EXAMPLE_FRAMES = 2000
"""Number of frames that a method learns from; all where the examples have fewer."""
NoisePreset = Literal["clean", "noise", "default"]
_ROLES = 3
"""Clips to choose on, held-out clips and examples have equal shares of a behaviour."""


@dataclass(frozen=True)
class PlacementQuestion:
    """How many stations, for which behaviours, and where they may be."""

    fewest: int
    most: int
    behaviours: tuple[Name, ...]
    places: tuple[str, ...] = ()
    """Names of places (see `harness.body.places`); the common ones by default."""
    method: str = DEFAULT_METHOD
    noise: NoisePreset = "default"
    constellation: str = ""
    """Name of the constellation under which the physics of the tracker is simulated; "" draws statistical errors."""
    minutes: float = DEFAULT_MINUTES
    """Budget of time [min]."""
    clips: int = 0
    """Number of clips to choose on, whatever the budget; 0 chooses it within the budget."""
    seed: int = 1
    effort: Effort = ""
    split: Literal["sequence", "subject"] = "sequence"
    base: tuple[str, ...] = ()
    """Names of places that every set contains."""
    costs: Mapping[str, float] = field(default_factory=dict)
    """Place -> cost; 1 for the others."""
    symmetric: bool = False
    """Whether left and right are one place, which both sides are worn at."""
    baud: int = 0
    """Rate of the serial line; 0 is the scenario's default."""
    second_method: str = ""
    """A method that the answer is repeated with; "" chooses one, "none" is none."""

    @property
    def name(self) -> str:
        """A name for files, such as "table_tennis_3" or "walking_boxing_2-4"."""
        sizes = f"{self.fewest}" if self.fewest == self.most else f"{self.fewest}-{self.most}"
        return f"{'_'.join(self.behaviours)}_{sizes}"

    @property
    def title(self) -> str:
        """The question in words."""
        sizes = f"{self.fewest}" if self.fewest == self.most else f"{self.fewest} to {self.most}"
        noun = "station" if self.most == 1 else "stations"
        return f"Where are {sizes} {noun} worn for {' and '.join(map(plain_name, self.behaviours))}?"


def plain_name(name: str) -> str:
    """A name with blanks instead of underscores."""
    return name.replace("_", " ")


def question_study(question: PlacementQuestion, folder: LibraryFolders | None) -> tuple[PlacementStudy, Scenario]:
    """The study that answers a question, with all clips that it may use, and its scenario.

    Without `folder` the motion is built in, else that of the library. UnknownName for a place, a behaviour or a
    constellation; BadInput for a number of stations that the places do not allow, and for a behaviour with too few
    clips.
    """
    places = select_places(question.places)
    physics = Physics(ConstellationSettings(name=question.constellation)) if question.constellation else None
    if physics is not None:
        load_constellation(physics.constellation)  # refuses a name that does not exist
    most = min(MAX_STATIONS, len(places))
    if not 1 <= question.fewest <= question.most <= most:
        raise BadInput(
            f"{question.fewest} to {question.most} stations of {len(places)} places.",
            f"Ask for 1 to {most}, the smaller number first; --places names more places, `harness list places` all.",
        )
    source = open_motion_source("builtin" if folder is None else "cmu", folder, seed=question.seed, rate_hz=None)
    wanted = question.clips or DEFAULT_CLIPS
    asked = list(dict.fromkeys(question.behaviours))
    parts = [_deal_clips(name, source, at * wanted // len(asked), wanted) for at, name in enumerate(asked)]
    test, held_out, examples = (list(_interleave([part[role] for part in parts])) for role in range(_ROLES))
    if question.clips > len(test):
        raise BadInput(f"{question.clips} clips of {len(test)} to choose on.", f"Ask for {len(test)} clips or fewer.")
    test, held_out = test[:wanted], held_out[:DEFAULT_CLIPS]
    if folder is None:
        examples = _one_of_each(examples, {source.subject(name) for name in (*test, *held_out)}, source)
    scenario = Scenario(
        name=question.name,
        motion=ScenarioMotion(
            source="builtin" if folder is None else "cmu",
            test=tuple(test),
            behaviours=_behaviours(test, source),
            examples=tuple(examples),
            thin_to=_thinned_frames(examples, source),
            body="common",
            longest_s=CLIP_S,
        ),
        stations={place.name: Station(place.bone, place.along, place.around_deg) for place in places},
        methods=(question.method,),
        seed=question.seed,
        noise=question.noise,
        physics=physics,
    )
    study = PlacementStudy(
        name=question.name,
        kind="placement",
        title=question.title,
        scenario=question.name,
        methods=(question.method,),
        held_out=tuple(held_out),
        link=True,
        candidate=tuple(Candidate(place.name, place.bone, place.along, place.around_deg) for place in places),
        exhaustive=ExhaustiveOptions(question.most, question.fewest, most_cells=100_000_000),
        sizes=tuple(range(question.fewest, question.most + 1)),
        condition_size=question.most,
    )
    return study, scenario


def _thinned_frames(examples: Sequence[str], source: MotionSource) -> int:
    """`EXAMPLE_FRAMES` if the examples have so many at the tracker's rate, else 0, which keeps all of them.

    Clips are loaded until there are enough. Resampling may drop the last frame of each.
    """
    rate_hz, frames = TrackerConfig().rate_hz, 0
    for name in examples:
        clip = source.load(name)
        frames += int(len(clip) / clip.rate_hz * rate_hz) - 1
        if frames >= EXAMPLE_FRAMES:
            return EXAMPLE_FRAMES
    return 0


def _deal_clips(behaviour: str, source: MotionSource, first: int, wanted: int) -> tuple[list[str], ...]:
    """Clips of a behaviour to choose on, to hold out and to learn from; each performer's takes are dealt in turn.

    Performers alternate, from the one with the index `first` on. The held-out clips begin `wanted` performers later, so
    that they are of other performers where there are enough.
    """
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
    starts = (first, first + wanted, first)
    return tuple(
        list(_interleave([role[subject] for subject in _rotate(list(role), start)]))
        for role, start in zip(dealt, starts, strict=True)
    )


def _rotate(items: Sequence[str], start: int) -> list[str]:
    """The items from index `start` on, which wraps around."""
    at = start % len(items)
    return [*items[at:], *items[:at]]


def _one_of_each(clips: Sequence[str], subjects: Collection[str], source: MotionSource) -> list[str]:
    """The first of the clips of each behaviour and each of these performers: the generator has thousands of takes."""
    first: dict[tuple[str, str], str] = {}
    for name in clips:
        if source.subject(name) in subjects:
            first.setdefault((source.behaviour(name), source.subject(name)), name)
    return list(first.values())


def _interleave(lists: Sequence[Sequence[str]]) -> Iterator[str]:
    """The items of several lists in turn, so that the first n have equal shares of all while they last."""
    for at in range(max(map(len, lists))):
        yield from (items[at] for items in lists if at < len(items))


def _behaviours(clips: Sequence[str], source: MotionSource) -> tuple[str, ...]:
    """One word if all clips have the same behaviour, else one for each clip."""
    words = tuple(map(source.behaviour, clips))
    return words[:1] if len(set(words)) == 1 else words


def plan_within_budget(
    study: PlacementStudy, scenario: Scenario, question: PlacementQuestion, cell_s: float, jobs: int
) -> tuple[PlacementStudy, Scenario, str]:
    """The study within the question's budget, its scenario, and a sentence about what the budget allowed.

    The first of these that fits is chosen: every set on all clips; every set on the least number of clips that can
    show a difference between so many sets; one station after another on all clips; the same on ever fewer clips. The
    last has six clips, and is chosen even if it does not fit.
    """
    places = len(study.candidate)
    sets = sum(math.comb(places, size) for size in study.sizes)
    one_by_one = sum(places - worn for worn in range(study.sizes[-1]))
    given = len(scenario.motion.test)
    least = min(given, count_needed(max(math.comb(places, size) for size in study.sizes) - 1))
    few = [] if question.clips else [least]
    fewer = [] if question.clips else list(range(given - 1, min(given, LEAST_CLIPS) - 1, -1))
    tested = len(study.sizes) * len(study.held_out)
    plans = [(True, clips) for clips in (given, *few)] + [(False, clips) for clips in (given, *fewer)]

    def duration_s(exhaustive: bool, clips: int) -> float:
        return ((sets if exhaustive else one_by_one) * clips + tested) * cell_s / jobs

    exhaustive, clips = next((plan for plan in plans if duration_s(*plan) <= 60.0 * question.minutes), plans[-1])
    motion = replace(scenario.motion, test=scenario.motion.test[:clips])
    if len(motion.behaviours) > 1:
        motion = replace(motion, behaviours=motion.behaviours[:clips])
    scenario = replace(scenario, motion=motion)
    text = f"every one of {sets:,} sets" if exhaustive else "one station after another, the best next one each time"
    note = f"Within {question.minutes:g} minutes: {text}, on {clips} clips."
    if not exhaustive:
        whole_min = duration_s(True, given) / 60.0
        note += f" Every one of {sets:,} sets would take about {whole_min:.0f} minutes on {given} clips."
        options = GreedyOptions(study.sizes[-1])
        study = replace(study, exhaustive=None, greedy=options)
    return study, scenario, note
