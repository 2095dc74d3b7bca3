"""Text and page of a placement study: the answer comes first, numbers have intervals, and ties are called ties."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.cli import main
from harness.report.kit.render_process import start_renderer
from harness.report.placement import body_map as body
from harness.report.placement import page as placement_page
from harness.report.placement.body_map import draw_body_map, interpolate_colours, select_body_maps
from harness.report.placement.charts import pareto_chart
from harness.report.placement.page import placement_text, write_placement_page
from harness.report.placement.wording import placement_sentence, set_name, smallest_sufficient_set
from harness.results.placement_findings import BestSet, PlacementFindings, StationNames, StationSetResult
from tests.report.fabricate_placement import CLIPS, PLACES, made_up, write_made_up
from tests.report.reading import text_of

NO_PICTURE = "the renderer was ended by SIGABRT"
ANSWER = (
    "Of 1 to 3 stations, 3 have the lowest error: both ankles + pelvis, 2.40 deg (2.01 to 2.79). "
    "On 6 held-out units the error is 2.52 deg (2.12 to 2.92). Sets were chosen on 8 clips."
)


@pytest.fixture(scope="module")
def findings() -> PlacementFindings:
    return made_up()


@pytest.fixture
def unseen(monkeypatch: pytest.MonkeyPatch) -> None:
    """Simulate a machine that cannot render; the page must say so."""
    monkeypatch.setattr(placement_page, "draw_body_map", lambda *args, **options: (None, NO_PICTURE))


def study_of(errors: dict[StationNames, list[float | None]], better: str = "lower") -> PlacementFindings:
    """Findings with these sets in order of size, each the best of its size."""
    tried = [
        StationSetResult(stations, 40.0, dict(zip(CLIPS, values, strict=False)), _mean(values))
        for stations, values in errors.items()
    ]
    best = tuple(BestSet(t.stations) for t in tried)
    whole = replace(made_up(at_most=1), tried=tuple(tried), best=best, rankings=(), searches=(), contributions=())
    return replace(whole, compared=(), conditions=(), agreements=(), better="higher" if better == "higher" else "lower")


def _mean(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None


def test_pairs_have_one_name() -> None:
    assert set_name(("head", "left_ankle", "right_ankle", "pelvis")) == "both ankles + head + pelvis"
    assert set_name(("left_foot", "right_foot", "left_hand")) == "both feet + left hand"
    assert set_name(()) == "none"


def test_the_fewest_that_nothing_shows_to_be_worse_are_enough() -> None:
    two, three = ("left_ankle", "right_ankle"), ("pelvis", "left_ankle", "right_ankle")
    base = [2.0, 2.1, 1.9, 2.2, 1.8, 2.0, 2.05, 1.95]
    wiggle = [0.1, -0.1, 0.1, -0.1, 0.1, -0.1, 0.1, -0.12]
    alike = study_of({two: [b + w for b, w in zip(base, wiggle, strict=True)], three: [b - 0.01 for b in base]})
    chosen = smallest_sufficient_set(alike)
    assert chosen is not None
    assert chosen.stations == two
    assert placement_sentence(alike).startswith("2 stations are as good as up to 3: both ankles, 2 deg")
    apart = study_of({two: [b + 0.5 + w for b, w in zip(base, wiggle, strict=True)], three: list(base)})
    assert placement_sentence(apart).startswith("Of 1 to 3 stations, 3 have the lowest error: both ankles + pelvis")
    fps = study_of({two: [b - 0.5 + w for b, w in zip(base, wiggle, strict=True)], three: list(base)}, "higher")
    chosen = smallest_sufficient_set(fps)
    assert chosen is not None
    assert chosen.stations == three


def test_too_few_clips_are_said_to_be_too_few() -> None:
    few = study_of({("pelvis",): [2.0, 2.1, 2.2], ("head", "pelvis"): [1.0, 1.1, 1.2]})
    assert "but at least 6 units are needed to compare sets, instead of 3: head + pelvis" in placement_sentence(few)


def test_where_nothing_was_measured_nothing_is_recommended() -> None:
    nothing = study_of({("pelvis",): [None] * 8})
    assert placement_sentence(nothing) == "No set of stations was measured."
    assert "not measured" in placement_text(nothing)
    assert pareto_chart(nothing) is None


def test_the_text_opens_on_the_answer_and_has_every_table(findings: PlacementFindings) -> None:
    lines = placement_text(findings).splitlines()
    assert " ".join(lines[:2]) == ANSWER
    whole = "\n".join(lines)
    for part in (
        "3         both ankles + pelvis  2.40 deg (2.01 to 2.79)  2.52 deg (2.12 to 2.92)",
        "the last set lowers",
        "reproduced",
        "exhaustive: 3 of 11 places",
        "and 8 more",
        "+ pelvis       both ankles + pelvis  2.40 deg",
        "left out of all 11",
        "boxing (behaviour, 8 units)",
        "0.31 (0.22 to 0.40)",
        "FAILED ik on p3_walking_3 (worn=head): ValueError: <b>no</b>",
    ):
        assert part in whole, part
    assert max(map(len, lines)) <= 160


def test_ties_are_called_ties(findings: PlacementFindings) -> None:
    first, *others = findings.rankings[0].rows
    level = replace(others[0], tied=True, difference=0.001, low=-0.01, high=0.012)
    ranking = replace(findings.rankings[0], rows=(first, level))
    best = replace(findings.best[1], ties=(level.stations,))
    tied = replace(findings, rankings=(ranking,), best=(findings.best[0], best))
    row = next(line for line in placement_text(tied).splitlines() if line.startswith("2") and " tie " in line)
    assert "+0.001 (−0.010 to +0.012)" in row
    assert set_name(level.stations) in next(
        line for line in placement_text(tied).splitlines() if line.startswith("2  ")
    )


@pytest.mark.usefixtures("unseen")
def test_the_page_opens_on_the_answer_and_says_what_is_missing(tmp_path: Path, findings: PlacementFindings) -> None:
    hostile = "<script>alert(1)</script>"
    shown = replace(
        findings, notes=(hostile,), rankings=findings.rankings[1:], contributions=findings.contributions[:11]
    )
    page = write_placement_page(write_made_up(tmp_path, shown))
    content, said = page.read_text(encoding="utf-8"), text_of(page)
    assert f"<h1>{ANSWER}</h1>" in content
    assert content.index("<h1>") < content.index('aria-label="best sets"') < content.index("<nav")
    assert f"The body map: {NO_PICTURE}" in said
    assert hostile not in content
    assert hostile in said
    for place in PLACES:
        assert place.name.replace("_", " ") in said
    for part in (
        "called suitable",
        "not run",
        "both thighs + left ankle",
        "+0.374 +0.305 to +0.443",
        "ValueError",
    ):
        assert part in said, part
    assert len(re.findall("<img", content)) == 5
    assert "http://" not in content.replace("http://www.w3.org", "")
    assert {file.suffix for file in (tmp_path / "plots").iterdir()} == {".svg", ".png"}


@pytest.mark.usefixtures("unseen")
def test_the_report_verb_writes_the_same_page_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = write_made_up(tmp_path, replace(made_up(at_most=1), contributions=()))
    first = write_placement_page(folder).read_bytes()
    assert main(["report", str(folder), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said == {"report": str(folder / "report.html"), "next": f"harness plot {folder}", "outcome": "pass"}
    assert (folder / "report.html").read_bytes() == first
    assert main(["report", str(folder), "--methods", "ik", "--readme", str(tmp_path / "README.md")]) == 2
    assert "a placement study" in capsys.readouterr().err


def test_candidates_are_shown_among_each_other_and_beside_what_is_worn(findings: PlacementFindings) -> None:
    among, more = select_body_maps(findings.contributions)
    assert len(among[0]) == len(PLACES)
    assert among[1:] == ("error without it minus error with all 11 stations", ())
    assert more[2] == ("pelvis", "left_ankle", "right_ankle")
    assert set(more[0]) == {place.name for place in PLACES} - set(more[2])
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
    chart, missing = draw_body_map(PLACES, values, "worth", ("right_ankle",), unit="deg")
    assert chart is not None
    assert missing == ""
    assert "right ankle (worn)" in chart.svg
    for n, place in enumerate(PLACES[:-1]):
        said = f"{place.name.replace('_', ' ')} +{0.1 * n:.2f}" if n else f"{place.name} 0.00"
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


def test_without_held_out_clips_the_cross_validated_error_is_beside_the_error(findings: PlacementFindings) -> None:
    best = tuple(replace(each, held_out=None, cross_validated_error=3.21) for each in findings.best)
    lines = placement_text(replace(findings, best=best)).splitlines()
    head = next(line for line in lines if line.startswith("stations  best set"))
    assert "cross-validated" in head
    assert "3.21 deg" in lines[lines.index(head) + 2]
    assert "cross-validated" not in placement_text(findings)
