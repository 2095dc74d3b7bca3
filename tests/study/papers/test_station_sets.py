"""Sets of trackers: verdicts on made-up errors, where the right one is known."""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.core.humanoid24 import standard_skeleton
from harness.core.motion import Clip
from harness.results.findings import Verdict
from harness.study.papers import station_sets
from harness.study.papers.kim2012 import PAPER
from harness.study.papers.paper_study import PaperStudy
from harness.study.papers.station_sets import (
    LIMBS,
    STATION_ABBREVIATIONS,
    average_by_size,
    claim_best_of_size,
    claim_better_than_average,
    claim_error_decreases,
    claim_harder,
    claim_most_movable,
    claim_suitable,
    count_stations,
    errors_by_set,
    format_station_set,
    measure_ranges,
    ranked_bars,
    set_table,
    station_count_lines,
)

Made = dict[str, dict[str, float]]
CLIPS = tuple(f"clip_{k}" for k in range(8))
ALL = tuple(format_station_set(worn) for n in range(1, 6) for worn in itertools.combinations(STATION_ABBREVIATIONS, n))


def made(rng: np.random.Generator, means: dict[str, float], clips: tuple[str, ...] = CLIPS) -> Made:
    """Errors with these means, that differ much from clip to clip and little from set to set beside that."""
    of_clip = rng.uniform(2.0, 6.0, len(clips))
    draws = {name: of_clip + mean + rng.normal(0.0, 0.01, len(clips)) for name, mean in means.items()}
    return {name: dict(zip(clips, map(float, row), strict=True)) for name, row in draws.items()}


def test_a_set_is_named_in_the_papers_order() -> None:
    assert len(set(ALL)) == 31
    assert format_station_set(["pelvis", "left_ankle", "right_hand"]) == "RH+LA+PEL"
    assert [count_stations(name) for name in ("PEL", "RH+PEL", "RH+LH+RA+LA+PEL")] == [1, 2, 5]


def test_rows_are_put_together_by_what_is_worn() -> None:
    kind = {"method": "kernel_cca", "inputs": "pos+ori", "split": "sequence", "performer": "known", "lag": 0}
    kind |= {"behaviour": "walking", "unit_clips": 1}
    rows = [
        {**kind, "varied": {"worn": worn}, "stations": worn, "clip": clip, "unit": clip, "joint_angle_mean_deg": error}
        for clip, worn, error in (("a", ["pelvis"], 1.0), ("b", ["pelvis"], 2.0), ("a", ["pelvis", "right_hand"], 3.0))
    ]
    assert errors_by_set(rows) == {"PEL": {"a": 1.0, "b": 2.0}, "RH+PEL": {"a": 3.0}}


@pytest.mark.parametrize(
    ("others", "best", "average"),
    [
        ((0.5, 0.7), "reproduced", "reproduced"),
        ((-0.5, 0.7), "not reproduced", "reproduced"),
        ((-0.5, -0.3), "not reproduced", "not reproduced"),
        ((0.0, 0.7), "same", "reproduced"),
    ],
)
def test_a_set_is_the_best_of_as_many_trackers_or_it_is_not(
    others: tuple[float, float], best: Verdict, average: Verdict
) -> None:
    """Larger and smaller sets have no say, however well they do."""
    rng = np.random.default_rng(1)
    means = {"RA+LA+PEL": 0.0, "RH+LH+PEL": others[0], "RH+LH+RA": others[1], "PEL": -2.0, "RH+LH+RA+PEL": -2.0}
    sets = made(rng, means)
    claim = claim_best_of_size("walking", "RA+LA+PEL", sets)
    assert claim.verdict == best
    assert "RH+LH+PEL" in claim.text
    assert claim.value == pytest.approx(others[0], abs=0.02)
    assert claim_better_than_average("walking", "RA+LA+PEL", sets).verdict == average


def test_few_clips_cannot_tell_and_none_were_not_run() -> None:
    few = made(np.random.default_rng(2), {"RA+LA+PEL": 0.0, "RH+LH+PEL": 9.0}, CLIPS[:5])
    for judge in (claim_best_of_size, claim_better_than_average):
        assert judge("walking", "RA+LA+PEL", few).verdict == "cannot tell"
        assert judge("walking", "RA+LA+PEL", {}).verdict == "not run"
    assert claim_error_decreases("walking", {}).verdict == "not run"
    assert claim_harder("x", {}, few["RH+LH+PEL"]).verdict == "not run"
    assert claim_harder("x", few["RH+LH+PEL"], few["RA+LA+PEL"]).verdict == "cannot tell"


@pytest.mark.parametrize(
    ("by_count", "verdict", "step"),
    [
        ((5.0, 4.0, 3.0, 2.0, 1.0), "reproduced", ""),
        ((5.0, 4.0, 4.5, 2.0, 1.0), "not reproduced", "2 to 3"),
        ((5.0, 4.0, 3.0, 2.0, 2.0), "same", "4 to 5"),
        ((5.0, 4.0, 4.0, 2.0, 2.5), "not reproduced", "4 to 5"),
    ],
)
def test_every_tracker_has_to_lower_the_error(by_count: tuple[float, ...], verdict: Verdict, step: str) -> None:
    sets = made(np.random.default_rng(3), {name: by_count[count_stations(name) - 1] for name in ALL})
    for name in (n for n in ALL if count_stations(n) == 5):  # one set is as noisy as the ten of three together are not
        sets[name] = {clip: error + 0.02 * (-1) ** k for k, (clip, error) in enumerate(sets[name].items())}
    claim = claim_error_decreases("walking", sets)
    assert claim.verdict == verdict
    assert step in claim.why


@pytest.mark.parametrize(
    ("four", "five", "verdict", "part"),
    [
        (0.05, 0.05, "reproduced", ""),  # an excess of 0.05 of about 4 deg; the margin is 2 %
        (-1.0, -1.0, "reproduced", ""),
        (0.05, 1.0, "not reproduced", "against RH+LH+RA+LA+PEL: "),
        (1.0, 0.05, "not reproduced", "against RH+RA+LA+PEL: "),
    ],
)
def test_three_stations_are_suitable_when_no_larger_set_is_better_by_the_margin(
    four: float, five: float, verdict: Verdict, part: str
) -> None:
    larger = {"RH+RA+LA+PEL": -four, "LH+RA+LA+PEL": 3.0, "RH+LH+RA+LA+PEL": -five}
    claim = claim_suitable("walking", "RA+LA+PEL", made(np.random.default_rng(6), {"RA+LA+PEL": 0.0, **larger}))
    assert claim.verdict == verdict
    assert claim.why.startswith(part)
    assert "LH+RA+LA+PEL" not in claim.measured.replace("RH+LH+RA+LA+PEL", "")


def test_a_suitable_set_needs_both_larger_sizes() -> None:
    sets = made(np.random.default_rng(7), {"RA+LA+PEL": 0.0, "RH+LH+RA+LA+PEL": 1.0})
    assert claim_suitable("walking", "RA+LA+PEL", sets).verdict == "not run"


@pytest.mark.parametrize(("gain", "verdict"), [(1.0, "reproduced"), (-1.0, "not reproduced"), (0.0, "same")])
def test_the_most_movable_stations_are_compared_with_the_rest_of_their_size(gain: float, verdict: Verdict) -> None:
    """Sets with one of the two have no say, nor have sets of other sizes."""
    ranges = {"RH": 40.0, "LH": 50.0, "RA": 70.0, "LA": 60.0, "PEL": 0.0}
    both = {name: len({"RA", "LA"} & set(name.split("+"))) for name in ALL}
    mean = {0: 0.0, 1: 9.0, 2: -gain}
    means = {name: mean[both[name]] if count_stations(name) in (2, 3) else -9.0 for name in ALL}
    claim = claim_most_movable("walking", ranges, made(np.random.default_rng(8), means))
    assert "RA and LA" in claim.text
    assert "RA 70" in claim.measured
    assert claim.verdict == verdict
    assert claim.value == pytest.approx(gain, abs=0.02)
    assert claim_most_movable("walking", ranges, {}).verdict == "not run"


def test_a_set_that_is_missing_on_a_clip_takes_the_clip_from_its_number() -> None:
    sets = {"RH": {"a": 1.0, "b": 2.0}, "PEL": {"b": 4.0}, "RH+PEL": {"a": 0.5, "b": 1.0}}
    assert average_by_size(sets) == {1: {"b": 3.0}, 2: {"a": 0.5, "b": 1.0}}
    assert claim_error_decreases("walking", {**sets, "PEL": {}}).verdict == "not run"


def test_harder_clips_need_not_be_the_same() -> None:
    rng = np.random.default_rng(4)
    walks, bouts = (
        {f"{what}_{k}": float(x) for k, x in enumerate(rng.normal(mean, 0.3, 8))}
        for what, mean in (("walk", 3.0), ("bout", 2.0))
    )
    claim = claim_harder("walking is harder", walks, bouts)
    assert claim.verdict == "reproduced"
    assert (claim.low or 0.0) < (claim.value or 0.0) < (claim.high or 0.0)
    assert claim_harder("boxing is harder", bouts, walks).verdict == "not reproduced"
    assert claim_harder("both", walks, dict(zip(bouts, walks.values(), strict=True))).verdict == "cannot tell"


def test_pictures_and_tables_rank_the_sets() -> None:
    sets = made(np.random.default_rng(5), {name: float(k) for k, name in enumerate(reversed(ALL))})
    bars = ranked_bars("bars", sets, "")
    means, low, high = (side["kernel_cca"] for side in (bars.series, bars.low, bars.high))
    assert bars.groups == tuple(reversed(ALL))
    for value, a, b in zip(means, low, high, strict=True):
        assert (a or 0.0) < (value or 0.0) < (b or 0.0)
    lines = station_count_lines("lines", {"walking": sets, "boxing": {}}, "")
    assert lines.x == (1.0, 2.0, 3.0, 4.0, 5.0)
    assert set(lines.series["boxing"]) == {None}
    table = set_table("table", sets, sets, format_station_set(STATION_ABBREVIATIONS))
    assert [count_stations(row[0]) for row in table.rows] == sorted(map(count_stations, ALL))
    assert table.rows[-1][-1] == "1.00"
    assert set_table("table", {"PEL": sets["PEL"]}, {}, format_station_set(STATION_ABBREVIATIONS)).rows[0][2:] == (
        "not measured",
        "not measured",
    )


WIDTHS_DEG = {"rfemur.rx": 40.0, "rtibia.rx": 60.0, "lfemur.rx": 50.0, "rradius.rx": 90.0, "lhumerus.rx": 30.0}


class Ramps:
    """Every clip sweeps the hinges of `WIDTHS_DEG` evenly; the second half of each has ten times the range."""

    def load(self, name: str) -> Clip:
        skeleton, frames = standard_skeleton(), 1200
        ramp = np.concatenate([np.linspace(0.0, 1.0, 600), np.linspace(0.0, 10.0, 600)])
        angles = np.zeros((frames, len(skeleton.dof_names)))
        for hinge, width in WIDTHS_DEG.items():
            angles[:, skeleton.dof_names.index(hinge)] = np.deg2rad(width) * ramp
        turned = np.tile([1.0, 0.0, 0.0, 0.0], (frames, 1))
        return Clip(name, "p", "ramps", "walking", skeleton, 120.0, np.zeros((frames, 3)), turned, angles)


def test_a_limb_has_the_central_95_percent_of_its_most_movable_hinge(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(station_sets, "open_scenario_motion", lambda *_: Ramps())
    scenario = PAPER.plan("builtin", 1)["sensors_walking"]
    motion = replace(scenario.motion, examples=("a", "b"), withheld=("a@0.50-1.00", "b@0.50-1.00"))
    study = PaperStudy(tmp_path, "builtin", 1, {"sensors_walking": replace(scenario, motion=motion)})
    kept = (600 - 120 - 1) / 599  # the guard time before the withheld half
    wanted = {"right_hand": 90.0, "left_hand": 30.0, "right_ankle": 60.0, "left_ankle": 50.0, "pelvis": 0.0}
    found = measure_ranges(study, "sensors_walking")
    assert found.keys() == set(LIMBS)
    assert found == pytest.approx({name: 0.95 * kept * width for name, width in wanted.items()}, rel=1e-3)


def test_hands_move_most_in_bouts(tmp_path: Path) -> None:
    scenario = PAPER.plan("builtin", 1)["sensors_boxing"]
    motion = replace(scenario.motion, examples=scenario.motion.examples[:2], withheld=())
    study = PaperStudy(tmp_path, "builtin", 1, {"sensors_boxing": replace(scenario, motion=motion)})
    ranges = measure_ranges(study, "sensors_boxing")
    assert set(sorted(ranges, key=lambda name: -ranges[name])[:2]) == {"right_hand", "left_hand"}
