"""Text and page of a placement study: the answer comes first, numbers have intervals, and ties are called ties."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from harness.cli import main
from harness.core.number_format import Interval
from harness.report.kit.render_process import start_renderer
from harness.report.placement import body_map as body
from harness.report.placement import page as placement_page
from harness.report.placement.body_map import draw_body_map, interpolate_colours, select_body_maps
from harness.report.placement.charts import pareto_chart
from harness.report.placement.page import placement_text, write_placement_page
from harness.report.placement.wording import placement_sentence, set_name, smallest_sufficient_set
from harness.results.findings import BestSet, PlacementFindings, StationNames, StationSetResult, write_placement
from harness.study.placement.config import load_placement_study
from tests.report.reading import emptied, text_of

NO_PICTURE = "the renderer was ended by SIGABRT"
PLACES = [place for group in load_placement_study("walking").groups() for place in group]
CLIPS = tuple(f"walking_p{n}_01" for n in range(1, 9))
ALL, PELVIS = ("right_hand", "left_hand", "pelvis"), ("pelvis",)


@pytest.fixture
def unseen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Simulate a machine that cannot render; the page must say so."""
    monkeypatch.setattr(placement_page, "draw_body_map", lambda *args, **options: (None, NO_PICTURE))


def study_of(
    like: PlacementFindings,
    errors: dict[StationNames, list[float | None]],
    better: Literal["lower", "higher"] = "lower",
) -> PlacementFindings:
    """Findings with these sets in order of size, each the best of its size."""
    tried = [
        StationSetResult(stations, 40.0, dict(zip(CLIPS, values, strict=False)), _mean(values))
        for stations, values in errors.items()
    ]
    whole = replace(like, tried=tuple(tried), best=tuple(BestSet(t.stations) for t in tried), better=better)
    parts = ("rankings", "searches", "contributions", "compared", "conditions", "agreements")
    return replace(whole, unit="deg", **emptied(parts))


def _mean(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def test_pairs_have_one_name() -> None:
    assert set_name(("head", "left_ankle", "right_ankle", "pelvis")) == "both ankles + head + pelvis"
    assert set_name(("left_foot", "right_foot", "left_hand")) == "both feet + left hand"
    assert set_name(()) == "none"


def test_the_fewest_that_nothing_shows_to_be_worse_are_enough(placement: PlacementFindings) -> None:
    two, three = ("left_ankle", "right_ankle"), ("pelvis", "left_ankle", "right_ankle")
    base = [2.0, 2.1, 1.9, 2.2, 1.8, 2.0, 2.05, 1.95]
    wiggle = [0.1, -0.1, 0.1, -0.1, 0.1, -0.1, 0.1, -0.12]
    alike = study_of(
        placement, {two: [b + w for b, w in zip(base, wiggle, strict=True)], three: [b - 0.01 for b in base]}
    )
    chosen = smallest_sufficient_set(alike)
    assert chosen is not None
    assert chosen.stations == two
    assert placement_sentence(alike).startswith("2 stations are as good as up to 3: both ankles, 2 deg")
    apart = study_of(placement, {two: [b + 0.5 + w for b, w in zip(base, wiggle, strict=True)], three: list(base)})
    assert placement_sentence(apart).startswith("Of 1 to 3 stations, 3 have the lowest error: both ankles + pelvis")
    fps = study_of(
        placement, {two: [b - 0.5 + w for b, w in zip(base, wiggle, strict=True)], three: list(base)}, "higher"
    )
    chosen = smallest_sufficient_set(fps)
    assert chosen is not None
    assert chosen.stations == three


def test_too_few_clips_are_said_to_be_too_few(placement: PlacementFindings) -> None:
    few = study_of(placement, {("pelvis",): [2.0, 2.1, 2.2], ("head", "pelvis"): [1.0, 1.1, 1.2]})
    assert "but at least 6 units are needed to compare sets, instead of 3: head + pelvis" in placement_sentence(few)


def test_where_nothing_was_measured_nothing_is_recommended(placement: PlacementFindings) -> None:
    nothing = study_of(placement, {("pelvis",): [None] * 8})
    assert placement_sentence(nothing) == "No set of stations was measured."
    assert "not measured" in placement_text(nothing)
    assert pareto_chart(nothing) is None


def test_the_text_opens_on_the_answer_and_has_every_table(placement: PlacementFindings) -> None:
    text = placement_text(replace(placement, failures={"ik on walk (worn=head)": "Traceback\nValueError: <b>no</b>"}))
    assert " ".join(text.split()).startswith(placement_sentence(placement))
    assert placement_sentence(placement).startswith("1 station is as good as up to 3: pelvis, ")
    assert max(map(len, text.splitlines())) <= 160
    for best in placement.best:
        tried = placement.of(best.stations)
        assert tried is not None
        row = next(line for line in text.splitlines() if line.startswith(f"{len(best.stations)}  "))
        assert str(Interval.of(tried.mean, tried.low, tried.high, "deg")) in row
    for ranking in placement.rankings:
        if len(ranking.rows) > 1:
            assert f"\n{ranking.mode}: " in text
            for ranked in ranking.rows[1:]:
                assert str(Interval.of(ranked.difference, ranked.low, ranked.high, signed=True)) in text
    for pair in placement.agreements:
        assert str(Interval.of(pair.tau, pair.low, pair.high)) in text
    for claim in placement.claims:
        assert claim.verdict in text
    for worth in placement.contributions:
        assert str(Interval.of(worth.difference, worth.low, worth.high, signed=True)) in text
    assert "FAILED ik on walk (worn=head): ValueError: <b>no</b>" in text
    assert "left out of all 3" in text


def test_ties_are_called_ties(placement: PlacementFindings) -> None:
    lines = placement_text(placement).splitlines()
    assert [line for line in lines if line.startswith("2 ") and "right hand + pelvis" in line and " tie " in line]
    assert next(line for line in lines if line.startswith("2  ")).endswith("right hand + pelvis")


@pytest.mark.usefixtures("unseen")
def test_the_page_opens_on_the_answer_and_says_what_is_missing(tmp_path: Path, placement: PlacementFindings) -> None:
    hostile = "<script>alert(1)</script>"
    write_placement(tmp_path / "findings.json", replace(placement, notes=(hostile,)))
    page = write_placement_page(tmp_path)
    content, said = page.read_text(encoding="utf-8"), text_of(page)
    assert f"<h1>{placement_sentence(placement)}</h1>" in content
    assert content.index("<h1>") < content.index('aria-label="best sets"') < content.index("<nav")
    assert f"The body map: {NO_PICTURE}" in said
    assert hostile not in content
    assert hostile in said
    for place in placement.candidates:
        assert place.name.replace("_", " ") in said
    for worth in placement.contributions:
        assert Interval.of(worth.difference, worth.low, worth.high, signed=True).number in said
    assert all(claim.target in said for claim in placement.claims)
    charts = len(re.findall("<img", content))
    assert charts == len(list((tmp_path / "plots").glob("*.svg"))) > 5
    assert "http://" not in content.replace("http://www.w3.org", "")
    assert {file.suffix for file in (tmp_path / "plots").iterdir()} == {".svg", ".png"}


@pytest.mark.usefixtures("unseen")
def test_the_report_verb_writes_the_same_page_again(
    tmp_path: Path, placement: PlacementFindings, capsys: pytest.CaptureFixture[str]
) -> None:
    write_placement(tmp_path / "findings.json", placement)
    first = write_placement_page(tmp_path).read_bytes()
    capsys.readouterr()
    assert main(["report", str(tmp_path), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said == {"report": str(tmp_path / "report.html"), "next": f"harness plot {tmp_path}", "outcome": "pass"}
    assert (tmp_path / "report.html").read_bytes() == first
    assert main(["report", str(tmp_path), "--methods", "ik", "--readme", str(tmp_path / "README.md")]) == 2
    assert "a placement study" in capsys.readouterr().err


def test_candidates_are_shown_among_each_other_and_beside_what_is_worn(placement: PlacementFindings) -> None:
    maps = select_body_maps(placement.contributions)
    assert (set(maps[0][0]), *maps[0][1:]) == (
        set(ALL),
        "mean error of sets without it minus mean error of sets with it",
        (),
    )
    (among,) = select_body_maps([worth for worth in placement.contributions if worth.mode == "ablate"])
    assert among[1] == "error without it minus error with all 3 stations"
    hands = ("right_hand", "left_hand")
    assert [(set(values), base) for values, _, base in maps if base] == [({"pelvis"}, hands)]
    assert select_body_maps(()) == []


def test_skin_has_the_colours_of_its_places_nearer_ones_more(rng: np.random.Generator) -> None:
    places, colours = np.array([[0.0, 0.0, 0.0], [0.4, 0.0, 0.0]]), np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    found = interpolate_colours(np.array([[0.0, 0.0, 0.0], [0.2, 0.1, 0.0], [0.4, 0.0, 0.0]]), places, colours)
    assert found[0, 0] > 0.99
    np.testing.assert_allclose(found[1], [0.5, 0.5, 0.0], atol=1e-12)
    assert found[2, 1] > 0.99
    points = rng.normal(size=(50, 3))
    np.testing.assert_allclose(interpolate_colours(points, places, colours).sum(axis=1), 1.0)
    np.testing.assert_allclose(interpolate_colours(points, places[:1], colours[:1]), np.tile(colours[0], (50, 1)))


def test_names_stand_beside_the_body_and_apart(monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator) -> None:
    """Every place has its name and value, and no label overlaps another; the picture itself is a stand-in."""
    height, width = 74, 76
    at = np.stack([rng.uniform(0.05, 0.95, len(PLACES)) * width, rng.uniform(0.1, 0.95, len(PLACES)) * height], axis=1)
    facing = rng.choice([-1.0, 1.0], len(PLACES))
    views = {
        "picture": np.full((2, height, width, 4), 200, np.uint8),
        "at": np.array([np.column_stack([at, sign * facing]) for sign in (1.0, -1.0)]),
    }
    monkeypatch.setattr(body, "render_body", lambda *args: (views, ""))
    values = {place.name: 0.1 * n for n, place in enumerate(PLACES[:-1])}
    chart, missing = draw_body_map(PLACES, values, "worth", (PLACES[-1].name,), unit="deg")
    assert chart is not None
    assert missing == ""
    assert f"{PLACES[-1].name.replace('_', ' ')} (worn)" in chart.svg
    for n, place in enumerate(PLACES[:-1]):
        said = f"{place.name.replace('_', ' ')} {f'+{0.1 * n:.2f}' if n else '0.00'}"
        assert said in chart.svg, said
        assert said in chart.alt
    assert "worth [deg]" in chart.svg
    assert "Dark balls: stations that are already worn." in chart.caption


def test_a_renderer_that_dies_takes_nothing_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        body, "start_renderer", lambda module, arguments: start_renderer("harness.report.not_there", [])
    )
    chart, missing = draw_body_map(PLACES, {"head": 0.1}, "worth", unit="deg")
    assert chart is None
    assert missing.startswith("the renderer failed")


def test_without_pyvista_or_values_the_reason_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    assert draw_body_map(PLACES, {"head": None}, "worth", unit="deg") == (
        None,
        "no candidate has a value",
    )
    monkeypatch.setattr(body, "find_spec", lambda name: None)
    chart, missing = draw_body_map(PLACES, {"head": 0.1}, "worth", unit="deg")
    assert chart is None
    assert "viz" in missing


@pytest.mark.slow
@pytest.mark.usefixtures("renders")
def test_the_rendered_body_has_the_colours_of_the_scale(monkeypatch: pytest.MonkeyPatch) -> None:
    """Skin is yellow at the largest contribution, purple at zero and grey where nothing was tried."""
    kept: dict[str, np.ndarray] = {}

    def keep(places: object, values: object, description: str, views: dict[str, np.ndarray], *rest: object) -> None:
        kept.update(views)

    monkeypatch.setattr(body, "_chart", keep)
    values = {"head": 0.0, "left_ankle": 0.5}
    worn = tuple(place.name for place in PLACES if place.name not in values)
    assert draw_body_map(PLACES, values, "worth", worn, unit="deg")[1] == ""
    picture, at = kept["picture"].astype(float), kept["at"]
    names = [place.name for place in PLACES]

    def skin(name: str, view: int, beside: tuple[int, int]) -> list[float]:
        across, down = at[view, names.index(name), :2].astype(int) + beside
        red, green, blue, opaque = picture[view, down, across]
        assert opaque == 255.0, f"{name} is on the body"
        return [float(red), float(green), float(blue)]

    red, green, blue = skin("left_ankle", 0, (-25, 0))
    assert min(red, green) > 2.0 * blue, "yellow"
    red, green, blue = skin("head", 0, (0, 25))
    assert min(red, blue) > 2.0 * green, "purple"
    grey = skin("sternum", 0, (40, 0))
    assert np.ptp(grey) < 25.0
    heights = {name: at[0, names.index(name), 1] for name in names}
    assert heights["head"] < heights["sternum"] < heights["pelvis"] < heights["left_thigh"] < heights["left_ankle"]
    assert at[0, names.index("left_hand"), 0] > at[0, names.index("right_hand"), 0], "the left is on the right"
    assert at[1, names.index("left_hand"), 0] < at[1, names.index("right_hand"), 0]
    assert at[0, names.index("pelvis"), 2] < 0.0 < at[1, names.index("pelvis"), 2], "the sacrum is seen from behind"


def test_without_held_out_clips_the_cross_validated_error_is_beside_the_error(placement: PlacementFindings) -> None:
    text = placement_text(placement)
    head = next(line for line in text.splitlines() if line.startswith("stations  best set"))
    assert "cross-validated" in head
    assert str(Interval.of(placement.best[0].cross_validated_error, None, None, "deg")) in text
    best = tuple(replace(each, held_out=3.21, held_out_low=3.0, held_out_high=3.5) for each in placement.best)
    held_out = placement_text(replace(placement, best=best))
    assert "cross-validated" not in held_out.split("\n\n")[1]
    assert "3.21 deg (3.00 to 3.50)" in held_out
