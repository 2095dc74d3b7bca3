"""A placement study from a question: how many stations for which behaviour, without a file.

    harness placement --stations 3 --behaviour table_tennis

A performer is the unit of statistics. Sets are chosen on some performers, the *pool*; errors and sizes are compared on
others, who are held out. Pool, held-out clips and examples do not depend on the effort, so that a set on a clip is the
same cell for every effort.
"""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from harness.body import NAMED_PLACES, select_places
from harness.core.ranges import Name
from harness.errors import BadInput
from harness.experiment.scenarios import Scenario, ScenarioMotion, Station
from harness.mocap import LibraryFolders, MotionSource, open_motion_source
from harness.results.findings import StationNames
from harness.results.findings.advice import Effort
from harness.simulate import TrackerConfig
from harness.simulate.physics import ConstellationSettings, Physics, load_constellation
from harness.study.placement.candidates import Candidate, CandidateGroup, StationSet, station_set
from harness.study.placement.config import MAX_STATIONS, PlacementStudy
from harness.study.placement.effort import CLIPS_BUDGET, DEFAULT_EFFORT, EFFORTS, Budget
from harness.study.placement.question_clips import QuestionClips, builtin_clips, library_clips

DEFAULT_METHOD, DEFAULT_SECOND, DEFAULT_STATIONS = "expert_map", "ik", 3
CLIP_S = 5.0
"""Length of each clip that is used [s]."""
EXAMPLE_FRAMES = 2000
"""Number of frames that a method learns from; all where the examples have fewer."""
NoisePreset = Literal["clean", "noise", "default"]


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
    effort: Effort = ""
    """How thoroughly sets are searched; "" is the default, or `clips`."""
    clips: int = 0
    """Number of clips of each behaviour to choose on, instead of an effort."""
    seed: int = 1
    split: Literal["sequence", "subject"] = "sequence"
    """Whether methods learn from other takes of the tested performer too, or from other performers alone."""
    base: tuple[str, ...] = ()
    """Names of places that every set contains."""
    costs: Mapping[str, float] = field(default_factory=dict)
    """Place -> cost; 1 for the others. Without any, the number of stations is the cost."""
    symmetric: bool = False
    """Whether left and right are one place, at which both sides are worn."""
    baud: int = 0
    """Rate of the serial line; 0 is that of the device."""
    second_method: str = ""
    """A method that the answer is repeated with; "" chooses one, "none" is none."""

    @property
    def name(self) -> str:
        """A name for files, such as "table_tennis_3" or "walking_boxing_2-4"."""
        sizes = f"{self.fewest}" if self.fewest == self.most else f"{self.fewest}-{self.most}"
        return f"{'_'.join(dict.fromkeys(self.behaviours))}_{sizes}"

    @property
    def title(self) -> str:
        """The question in words."""
        sizes = f"{self.fewest}" if self.fewest == self.most else f"{self.fewest} to {self.most}"
        noun = "station" if self.most == 1 else "stations"
        beside = f", {' and '.join(map(plain_name, self.base))} among them" if self.base else ""
        return f"Where are {sizes} {noun} worn for {' and '.join(map(plain_name, self.behaviours))}{beside}?"

    @property
    def search_effort(self) -> Effort:
        """The effort of the search; "" where it has a number of clips instead."""
        return "" if self.clips else self.effort or DEFAULT_EFFORT

    @property
    def budget(self) -> Budget:
        """What the search may use."""
        return CLIPS_BUDGET if self.clips else EFFORTS[self.search_effort]

    @property
    def second(self) -> str:
        """The second method; "" for none."""
        if self.second_method == "none":
            return ""
        return self.second_method or (DEFAULT_SECOND if self.method != DEFAULT_SECOND else DEFAULT_METHOD)


def plain_name(name: str) -> str:
    """A name with blanks instead of underscores."""
    return name.replace("_", " ")


@dataclass(frozen=True)
class QuestionStudy:
    """The study that answers a question, checked."""

    question: PlacementQuestion
    study: PlacementStudy
    scenario: Scenario
    """The scenario with all clips to choose on."""
    clips: QuestionClips
    base: tuple[CandidateGroup, ...]
    """The groups that every set contains."""
    station_costs: Mapping[str, float]
    """Candidate -> cost; {} if the number of stations is the cost."""

    def price(self, stations: StationNames) -> float:
        """The total cost of a set."""
        return math.fsum(self.station_costs.get(name, 1.0) for name in stations)


def question_study(question: PlacementQuestion, folder: LibraryFolders | None) -> QuestionStudy:
    """The study that answers a question. Without `folder` the motion is built in, else that of the library.

    UnknownName for a place, a behaviour or a constellation; BadInput for a number of stations that the places do not
    allow, for a cost of a place that is not asked about, for a behaviour with too few clips, and for a second method
    that is the first.
    """
    base = {place.name for place in select_places(question.base)} if question.base else set()
    asked = base | {place.name for place in select_places(question.places)}
    places = [name for name in NAMED_PLACES if name in asked]
    physics = Physics(ConstellationSettings(name=question.constellation)) if question.constellation else None
    if physics is not None:
        load_constellation(physics.constellation)  # refuses a name that does not exist
    costs = _station_costs(question.costs, places)
    if question.second == question.method:
        raise BadInput(f"--second-method {question.method} is the first one too.", "Name another one, or none.")
    candidates = _candidates(places, symmetric=question.symmetric)
    groups = tuple(group for candidate in candidates for group in candidate.groups())
    fixed = tuple(group for group in groups if base & {place.name for place in group})
    _check_sizes(question, groups, fixed)
    source = open_motion_source("builtin" if folder is None else "cmu", folder, seed=question.seed, rate_hz=None)
    choose = builtin_clips if folder is None else library_clips
    clips = choose(tuple(dict.fromkeys(question.behaviours)), source, split=question.split, most=question.clips)
    scenario = Scenario(
        name=question.name,
        motion=ScenarioMotion(
            source="builtin" if folder is None else "cmu",
            test=clips.test,
            behaviours=tuple(map(source.behaviour, clips.test)),
            examples=clips.examples,
            thin_to=_thinned_frames(clips.examples, source),
            split=question.split,
            body="common",
            longest_s=CLIP_S,
        ),
        stations={
            place.name: Station(place.bone, place.along, place.around_deg) for group in groups for place in group
        },
        methods=(question.method,),
        tracker=TrackerConfig(baud=question.baud) if question.baud else TrackerConfig(),
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
        held_out=tuple(clip for unit in clips.held_out.values() for clip in unit),
        link=True,
        candidate=candidates,
        sizes=tuple(range(question.fewest, question.most + 1)),
        condition_size=question.most,
    )
    return QuestionStudy(question, study, scenario, clips, fixed, costs)


def _candidates(names: Sequence[str], *, symmetric: bool) -> tuple[Candidate, ...]:
    """A candidate for each place; with `symmetric` one for both sides, BadInput for a place on one side alone."""
    candidates = []
    for name in names:
        place, bare = NAMED_PLACES[name], name.removeprefix("right_").removeprefix("left_")
        paired = symmetric and bare != name
        if paired and not {f"right_{bare}", f"left_{bare}"} <= set(names):
            raise BadInput(f"--symmetric with {name} alone.", f"Name {bare}, which is both sides.")
        if not paired or name.startswith("right_"):
            where = place.bone, place.along, place.around_deg
            candidates.append(Candidate(bare if paired else name, *where, pair="together" if paired else ""))
    return tuple(candidates)


def _check_sizes(question: PlacementQuestion, groups: Sequence[CandidateGroup], base: Sequence[CandidateGroup]) -> None:
    """BadInput for a number of stations that places, pairs or the stations of `--with` do not allow."""
    places, fixed = sum(map(len, groups)), sum(map(len, base))
    most = min(MAX_STATIONS, places)
    if not 1 <= question.fewest <= question.most <= most:
        raise BadInput(
            f"{question.fewest} to {question.most} stations of {places} places.",
            f"Ask for 1 to {most}, the smaller number first; --places names more places, `harness list places` all.",
        )
    if fixed > question.fewest:
        names = ", ".join(place.name for group in base for place in group)
        advice = f"Ask for {fixed} or more: --stations counts the stations of --with."
        raise BadInput(f"{question.fewest} stations cannot contain the {fixed} of --with ({names}).", advice)
    reached = {fixed}
    for group in groups:
        if group not in base:
            reached |= {size + len(group) for size in reached}
    for size in range(question.fewest, question.most + 1):
        if size not in reached:
            raise BadInput(f"No set of {size} stations: pairs are worn together.", "Ask for another number.")


def _station_costs(costs: Mapping[str, float], places: Sequence[str]) -> dict[str, float]:
    """Place -> cost, 1 where none is given; {} without costs. A name with its side precedes one without."""
    known = dict.fromkeys(places, 1.0)
    for name, cost in sorted(costs.items(), key=lambda item: item[0].startswith(("left_", "right_"))):
        covered = [place.name for place in select_places([name])]
        if missing := [one for one in covered if one not in known]:
            raise BadInput(f"--cost {name}: {missing[0]} is no place of this question.", f"It has {', '.join(known)}.")
        if not 0.0 < cost < math.inf:
            raise BadInput(f"--cost {name}={cost:g}.", "A cost is a number above 0.")
        known |= dict.fromkeys(covered, cost)
    return known if costs else {}


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


def count_sets(size: int, groups: Sequence[CandidateGroup], base: Sequence[CandidateGroup]) -> int:
    """Number of sets of so many stations that contain `base`, computed without listing them."""
    ways = [1] + [0] * size
    for group in groups:
        for total in range(size, len(group) - 1, -1) if group not in base else ():
            ways[total] += ways[total - len(group)]
    return ways[size - sum(map(len, base))]


def list_sets(size: int, groups: Sequence[CandidateGroup], base: Sequence[CandidateGroup]) -> list[StationSet]:
    """All sets of so many stations that contain `base`."""
    free, left = [group for group in groups if group not in base], size - sum(map(len, base))
    chosen = itertools.chain.from_iterable(itertools.combinations(free, count) for count in range(left + 1))
    return [station_set([*base, *added], groups) for added in chosen if sum(map(len, added)) == left]
