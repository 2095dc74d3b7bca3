"""Modes of searching, on costs whose truth is known: one station is necessary, one useless, one better elsewhere."""

from collections.abc import Mapping, Sequence

import pytest

from harness.core.seeds import generator
from harness.errors import BadInput
from harness.results.findings import CandidatePlace
from harness.study.placement.candidates import (
    Candidate,
    CandidateGroup,
    StationSet,
    make_candidate_groups,
    mirror_place,
    names_of_places,
    station_set,
)
from harness.study.placement.config import AblateOptions, AddOptions, ExhaustiveOptions, GreedyOptions, RefineOptions
from harness.study.placement.ranking import Costs
from harness.study.placement.refinement import find_move_groups, refine_set
from harness.study.placement.search import (
    ablate,
    add,
    best_measured_set,
    check_cell_count,
    exhaustive_sets,
    search_exhaustive,
    search_greedy,
)

CLIPS = tuple(f"clip_{n:02}" for n in range(12))
UNITS = make_candidate_groups(
    [
        Candidate("hand", "rhand", 0.5, 90.0, pair="each"),
        Candidate("ankle", "rtibia", 0.9, 90.0, pair="together"),
        Candidate("pelvis", "lhipjoint", 0.0, 165.0),
        Candidate("head", "head", 1.0),
    ]
)
SAVES = {"pelvis": 5.0, "right_ankle": 1.0, "left_ankle": 1.0, "right_hand": 0.5, "left_hand": 0.25, "head": 0.0}
"""What wearing each saves: the pelvis is necessary, the head useless."""


class Truth:
    """Costs that add up, with a little noise that a station of no use has none of."""

    def __init__(self, noise: float = 0.05) -> None:
        self.asked: list[StationSet] = []
        self.noise = noise

    def __call__(self, sets: Sequence[StationSet]) -> Mapping[StationSet, Costs]:
        self.asked += sets
        return {one: {clip: self.cost(one, clip) for clip in CLIPS} for one in sets}

    def cost(self, one: StationSet, clip: str) -> float:
        counted = [place for place in one if SAVES.get(place.moved_from or place.name)]
        chance = sum(generator(1, clip, place.name).normal() for place in counted)
        return 10.0 - sum(SAVES[place.moved_from or place.name] for place in counted) + self.noise * chance


def names(units: Sequence[CandidateGroup]) -> list[str]:
    return [place.name for unit in units for place in unit]


def test_ablation_finds_what_is_necessary_and_what_is_useless() -> None:
    truth = Truth()
    rankings, contributions = ablate(AblateOptions(), UNITS, truth)
    assert len(truth.asked) == 1 + len(UNITS)
    (ranking,) = rankings
    assert ranking.base == tuple(names(UNITS))
    assert "head" not in ranking.rows[0].stations
    assert "pelvis" not in ranking.rows[-1].stations
    worth = {each.candidate: each for each in contributions}
    assert worth["head"].difference == 0.0
    low = worth["pelvis"].low
    assert low is not None
    assert low > 4.5
    assert worth["left_ankle"].difference == worth["right_ankle"].difference == pytest.approx(2.0, abs=0.1)


def test_adding_finds_what_helps_a_base() -> None:
    rankings, contributions = add(AddOptions(base=("head",)), UNITS, Truth())
    (ranking,) = rankings
    assert ranking.rows[0].stations == ("pelvis", "head")
    assert not ranking.rows[1].tied
    assert len(ranking.rows) == len(UNITS) - 1
    best = max(contributions, key=lambda each: each.difference or 0.0)
    assert (best.candidate, best.base) == ("pelvis", ("head",))
    alone = add(AddOptions(), UNITS, Truth())
    assert alone[1] == ()  # beside nothing there is nothing to compare with
    assert alone[0][0].rows[0].stations == ("pelvis",)


def test_greedy_takes_the_necessary_one_first_and_the_useless_one_last() -> None:
    found = search_greedy(GreedyOptions(most=6), UNITS, Truth())
    assert [step.changed for step in found.steps] == [
        "+ pelvis",
        "+ right_ankle+left_ankle",
        "+ right_hand",
        "+ left_hand",
        "+ head",
    ]
    assert found.steps[0].difference is None
    assert found.steps[1].difference == pytest.approx(2.0, abs=0.1)
    assert found.steps[4].difference == 0.0
    assert found.steps[0].tied == ()


def test_greedy_stops_where_no_unit_fits() -> None:
    found = search_greedy(GreedyOptions(most=2, base=("pelvis",), of=("ankle",)), UNITS, Truth())
    assert [step.stations for step in found.steps] == [("pelvis",)]
    assert "no further unit fits into 2" in found.ended


def test_what_nothing_tells_apart_is_told_as_a_tie() -> None:
    units = make_candidate_groups([Candidate("head", "head"), Candidate("torso", "thorax")])
    found = search_greedy(GreedyOptions(most=1), units, lambda sets: {one: dict.fromkeys(CLIPS, 1.0) for one in sets})
    assert len(found.steps[0].tied) == 1


def test_exhaustive_tries_every_set_once_and_ranks_each_size() -> None:
    truth = Truth()
    rankings, contributions = search_exhaustive(ExhaustiveOptions(most=3), UNITS, truth)
    assert len(truth.asked) == len(set(truth.asked))
    assert {len(one) for one in truth.asked} == {1, 2, 3}
    assert [len(ranking.rows) for ranking in rankings] == [4, 7, 8]  # the pair counts as two
    assert [ranking.rows[0].stations for ranking in rankings] == [
        ("pelvis",),
        ("right_hand", "pelvis"),
        ("right_ankle", "left_ankle", "pelvis"),
    ]
    worth = {each.candidate: each.difference for each in contributions}
    for name, saves in (("pelvis", 5.0), ("right_hand", 0.5), ("left_ankle", 2.0), ("head", 0.0)):
        assert worth[name] == pytest.approx(saves, abs=0.1)


def test_exhaustive_counts_before_it_begins() -> None:
    for most in (1, 2, 3, 6):
        sets = len(exhaustive_sets(ExhaustiveOptions(most=most), UNITS))
        check_cell_count(ExhaustiveOptions(most=most, most_cells=8 * sets), UNITS, 8)
        with pytest.raises(BadInput, match=f"{sets:,} sets of up to {most} of 6 stations are {8 * sets:,} cells"):
            check_cell_count(ExhaustiveOptions(most=most, most_cells=8 * sets - 1), UNITS, 8)
    many = make_candidate_groups([Candidate(f"c{n}", "thorax", 0.5, float(n)) for n in range(60)])
    with pytest.raises(BadInput, match=r"cells, about [\d,]+ days for one worker") as refusal:
        check_cell_count(ExhaustiveOptions(most=12), many, 12)
    assert "greedy" in str(refusal.value)


def test_no_mode_tries_more_stations_than_a_tracker_has() -> None:
    many = make_candidate_groups([Candidate(f"c{n}", "thorax", 0.5, float(n)) for n in range(13)])
    with pytest.raises(BadInput, match="13 stations"):
        ablate(AblateOptions(), many, Truth())
    with pytest.raises(BadInput, match="13 stations"):
        add(AddOptions(base=tuple(f"c{n}" for n in range(12))), many, Truth())
    with pytest.raises(BadInput, match="no station remains"):
        ablate(AblateOptions(("pelvis",)), UNITS, Truth())


def bowl(one: StationSet) -> float:
    """Least where ankles sit at 0.5 along and 45 deg around, and the pelvis where it is."""
    off = 0.0
    for place in one:
        if place.bone.endswith("tibia"):
            off += 10.0 * (place.along - 0.5) ** 2 + ((abs(place.around_deg) - 45.0) / 90.0) ** 2
        else:
            off += 10.0 * place.along**2 + ((place.around_deg - 165.0) / 90.0) ** 2
    return 1.0 + off


class Measured:
    def __init__(self, asked: list[StationSet], noise: float) -> None:
        self.asked, self.noise = asked, noise

    def __call__(self, sets: Sequence[StationSet]) -> Mapping[StationSet, Costs]:
        self.asked += sets
        return {one: {clip: self.cost(one, clip) for clip in CLIPS} for one in sets}

    def cost(self, one: StationSet, clip: str) -> float:
        return bowl(one) + self.noise * generator(1, clip, *names_of_places(one)).normal()


START = station_set(make_candidate_groups([Candidate("ankle", "rtibia", 0.9, 90.0, pair="together")]), UNITS) + tuple(
    place for unit in UNITS for place in unit if place.name == "pelvis"
)


def test_refining_walks_to_the_best_place_with_pairs_in_step() -> None:
    measure = Measured([], 0.001)
    found, end = refine_set(RefineOptions(along=(0.2, 0.1), around_deg=(45.0, 22.5)), START, measure, len(CLIPS))
    assert [(place.along, place.around_deg) for place in end] == [(0.5, 45.0), (0.5, -45.0), (0.0, 165.0)]
    assert [place.name for place in end] == ["right_ankle@0.50/45", "left_ankle@0.50/-45", "pelvis"]
    for one in measure.asked:
        right, left, _ = one
        image = mirror_place(right)
        assert (left.along, left.around_deg) == (image.along, image.around_deg)
    assert found.steps[1].changed.startswith("right_ankle+left_ankle: ")
    assert all(step.low is not None and step.low > 0.0 for step in found.steps[1:])
    assert "significantly better" in found.ended


def test_refining_stays_where_nothing_is_better_beyond_noise() -> None:
    found, end = refine_set(RefineOptions(along=(0.01,), around_deg=(1.0,)), START, Measured([], 1.0), len(CLIPS))
    assert end == START
    assert len(found.steps) == 1


def test_refining_ends_after_as_many_moves_as_asked_for() -> None:
    found, _ = refine_set(RefineOptions(most_moves=1), START, Measured([], 0.001), len(CLIPS))
    assert len(found.steps) == 2
    assert "1 moves" in found.ended


def test_refining_on_too_few_clips_is_refused_with_how_many_it_takes() -> None:
    with pytest.raises(BadInput, match="9 units"):
        refine_set(RefineOptions(), START, Measured([], 0.1), 8)


def test_stations_that_are_no_mirror_images_move_alone() -> None:
    right, left, pelvis = START
    assert find_move_groups(START) == ((0, 1), (2,))
    assert find_move_groups((right, CandidatePlace("left_ankle", "ltibia", 0.8, -90.0, side="left"), pelvis)) == (
        (0,),
        (1,),
        (2,),
    )
    assert find_move_groups((left, pelvis, right)) == ((0, 2), (1,))


def test_the_best_that_was_tried_is_where_refining_may_begin() -> None:
    costs = {one: {"clip": bowl(one)} for one in (START, START[:2], START[1:])}
    assert best_measured_set(2, costs) == min((START[:2], START[1:]), key=bowl)
    with pytest.raises(BadInput, match="no set of 4 stations"):
        best_measured_set(4, costs)


def test_where_all_sets_have_one_size_a_contribution_is_without_it_against_with_it() -> None:
    options = ExhaustiveOptions(2, 2, ("hand", "pelvis", "head"))
    _, contributions = search_exhaustive(options, UNITS, Truth(noise=0.0))
    worth = {each.candidate: each.difference for each in contributions}
    assert worth["pelvis"] == pytest.approx((9.25 + 9.5 + 9.75) / 3.0 - (4.5 + 4.75 + 5.0) / 3.0)
    assert worth["head"] == pytest.approx((4.5 + 4.75 + 9.25) / 3.0 - (5.0 + 9.5 + 9.75) / 3.0)
    assert {each.mode for each in contributions} == {"exhaustive"}
    assert all(each.clips == len(CLIPS) for each in contributions)
