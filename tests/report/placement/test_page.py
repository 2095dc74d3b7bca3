"""Text and page of a placement study: the answer comes first, numbers have intervals, and ties are called ties."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.patches import Circle

from harness.cli import main
from harness.compare import compare_paired
from harness.core.number_format import Interval
from harness.report.kit.page import Drawing
from harness.report.kit.style import Chart
from harness.report.placement.answer import placement_sentence
from harness.report.placement.body_map import PALE, body_map
from harness.report.placement.charts import pareto_chart
from harness.report.placement.contribution_significance import significant_candidates
from harness.report.placement.error_curve import curve_points, error_curve
from harness.report.placement.page import placement_text, write_placement_page
from harness.report.placement.set_bodies import tied_sets_blocks
from harness.report.placement.study_answer import smallest_sufficient_set
from harness.report.placement.wording import plain_name, set_name
from harness.results.findings import (
    BestSet,
    MarginalContribution,
    PlacementFindings,
    StationNames,
    StationSetResult,
    write_placement,
)
from harness.results.findings.advice import PlacementAdvice, SecondChoice, SecondMethod, SetError, SizeStep
from harness.study.placement.config import load_placement_study
from tests.report.drawing import drawn_figures, points, texts_apart
from tests.report.reading import emptied, text_of

PLACES = [place for group in load_placement_study("walking").groups() for place in group]
CLIPS = tuple(f"walking_p{n}_01" for n in range(1, 9))
ALL, PELVIS = ("right_hand", "left_hand", "pelvis"), ("pelvis",)


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


def test_the_page_opens_on_the_answer_and_has_every_number(tmp_path: Path, placement: PlacementFindings) -> None:
    hostile = "<script>alert(1)</script>"
    write_placement(tmp_path / "findings.json", replace(placement, notes=(hostile,)))
    page = write_placement_page(tmp_path)
    content, said = page.read_text(encoding="utf-8"), text_of(page)
    assert f"<h1>{placement_sentence(placement)}</h1>" in content
    assert content.index("<h1>") < content.index('aria-label="best sets"') < content.index("<nav")
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


def test_every_page_has_the_body_with_the_recommended_set(placement: PlacementFindings, tmp_path: Path) -> None:
    """Also one whose sets were searched one station after another, which leaves no contributions."""
    for n, findings in enumerate((placement, replace(placement, contributions=()))):
        folder = tmp_path / str(n)
        folder.mkdir()
        write_placement(folder / "findings.json", findings)
        content = write_placement_page(folder).read_text(encoding="utf-8")
        assert (
            content.index("<h1>")
            < content.index("The body with the recommended stations pelvis")
            < content.index("<dl")
        )
        assert (folder / "plots" / "body_map.svg").exists()


def test_what_cannot_be_told_from_zero_is_pale(rng: np.random.Generator) -> None:
    """Of pictures of eleven places that do not matter at most one in ten shows any; a place that matters is found."""

    def contributions(effects: list[float]) -> list[MarginalContribution]:
        errors = [{f"u{n}": float(v) for n, v in enumerate(rng.normal(effect, 1.0, 16))} for effect in effects]
        zero = dict.fromkeys(errors[0], 0.0)
        gains = [compare_paired(each, zero) for each in errors]
        return [
            MarginalContribution(place.name, "exhaustive", (), gain.mean, gain.low, gain.high, len(gain.units))
            for place, gain in zip(PLACES, gains, strict=False)
        ]

    none = [significant_candidates(contributions([0.0] * 11)) for _ in range(200)]
    assert sum(map(bool, none)) <= 20
    planted = [significant_candidates(contributions([1.5, *[0.0] * 9, -1.5])) for _ in range(50)]
    assert sum({PLACES[0].name, PLACES[10].name} <= told for told in planted) >= 45
    assert (
        significant_candidates([replace(row, low=None, high=None) for row in contributions([9.0] * 3)]) == frozenset()
    )


def test_labels_of_the_body_stand_apart_and_say_which_are_pale(placement: PlacementFindings) -> None:
    rows = tuple(
        MarginalContribution(place.name, "exhaustive", (), 0.1 * n, 0.1 * n - 0.02 if n > 8 else -3.0, 3.0, 12)
        for n, place in enumerate(PLACES)
    )
    many = replace(placement, candidates=tuple(PLACES), contributions=rows, base=())
    charts: list[Chart] = []
    figures = drawn_figures(lambda: charts.append(body_map(many, (PLACES[0].name,))))
    texts_apart(figures["body_map"])
    pale = {row.candidate for row in rows} - significant_candidates(rows)
    assert 0 < len(pale) < len(rows)
    for n, place in enumerate(PLACES):
        note = " (cannot be told from zero)" if place.name in pale else ""
        assert f"{plain_name(place.name)} {'+' * (n > 0)}{0.1 * n:.2f}{note}" in charts[0].alt
    circles = [patch for axes in figures["body_map"].axes for patch in axes.patches if isinstance(patch, Circle)]
    colours = [to_hex(circle.get_edgecolor()) for circle in circles]
    assert colours.count(PALE) == len(pale)
    shown = [text.get_text() for text in figures["body_map"].legends[0].get_texts()]
    assert shown == ["recommended", "error is lower with it", "cannot be told from zero"]


def test_the_curve_has_held_out_errors_and_shows_which_steps_can_be_told(placement: PlacementFindings) -> None:
    one, two, three = (best.stations for best in placement.best)
    held = tuple(
        replace(best, held_out=error, held_out_low=error - 0.5, held_out_high=error + 0.5, held_out_clips=16)
        for best, error in zip(placement.best, (6.0, 4.0, 4.5), strict=True)
    )
    steps = (SizeStep(one, two, 2.0, 1.5, 2.5, 0.01, 16, "better"), SizeStep(two, three, -0.5, -1.0, 0.1, 0.2, 16))
    findings = replace(placement, best=held, size_steps=steps)
    assert [(point.at, point.error.value, point.on_front) for point in curve_points(findings)] == [
        (1.0, 6.0, True),
        (2.0, 4.0, True),
        (3.0, 4.5, False),
    ]
    figure = drawn_figures(lambda: error_curve(findings))["error_curve"]
    texts_apart(figure)
    lines = {str(line.get_label()): line for line in figure.axes[0].lines if not str(line.get_label()).startswith("_")}
    assert {name: points(line)[0].tolist() for name, line in lines.items()} == {
        "the larger set is better": [1.0, 2.0],
        "cannot be told apart": [2.0, 3.0],
    }
    asked = curve_points(replace(findings, sizes=(2, 3)))
    assert [point.at for point in asked] == [2.0, 3.0]
    text = placement_text(findings)
    assert "a smaller set" in text
    assert "−0.5 (−1.0 to +0.1)" in text
    costs = {"pelvis": 1.0, "left_hand": 2.5, "right_hand": 1.0}
    front = (SetError(one, 7.0, 6.0, 8.0, 16, 1.0), SetError(three, 4.5, 4.0, 5.0, 16, 4.5))
    gain = (SizeStep(one, three, 2.5, 1.5, 3.5, 0.01, 16, "better"),)
    dear = replace(findings, station_costs=costs, front=front, size_steps=gain)
    assert [(p.at, p.error.value) for p in curve_points(dear)] == [(1.0, 7.0), (4.5, 4.5)]
    charts: list[Chart | None] = []
    (axes,) = drawn_figures(lambda: charts.append(error_curve(dear)))["error_curve"].axes
    assert "the dearer set is better" in [line.get_label() for line in axes.lines]
    assert charts[0] is not None
    assert "against the cost of the stations" in charts[0].alt


def test_tied_sets_are_bodies_the_best_first_and_the_rest_is_counted(placement: PlacementFindings) -> None:
    places = [place.name for place in PLACES]
    ties = tuple((places[a], places[b]) for a in range(4) for b in range(a + 1, 5))
    best = BestSet(ties[0], ties[1:], of=12)
    findings = replace(
        placement,
        candidates=tuple(PLACES),
        best=(best,),
        advice=PlacementAdvice(SetError(ties[0]), "only", ties[1:], 12),
    )
    (drawing,) = tied_sets_blocks(findings, ties[0])
    assert isinstance(drawing, Drawing)
    made: list[Chart] = []
    figure = drawn_figures(lambda: made.append(drawing.chart()))["tied_sets"]  # type: ignore[operator, arg-type]
    assert len(figure.axes) == 8
    assert [sum(isinstance(patch, Circle) for patch in axes.patches) for axes in figure.axes] == [2] * 8
    assert made[0].caption.endswith("And 2 more.")
    text = placement_text(findings)
    assert "and 2 more" in text[text.index("\ntied sets\n") :].split("\n\n")[0]
    assert tied_sets_blocks(replace(findings, best=(), advice=None), ties[0]) == []


@pytest.mark.parametrize("worse", [True, False])
def test_where_two_methods_disagree_the_page_begins_with_it(
    placement: PlacementFindings, tmp_path: Path, *, worse: bool
) -> None:
    choice = SecondChoice(("pelvis",), ("right_hand",), 1.25, 0.5, 2.0, worse, 3, 16)
    advice = PlacementAdvice(SetError(("pelvis",), 3.0, 2.0, 4.0, 16), "smallest", of=3)
    findings = replace(placement, second=SecondMethod("ridge", (choice,)), advice=advice)
    write_placement(tmp_path / "findings.json", findings)
    content = write_placement_page(tmp_path).read_text(encoding="utf-8")
    assert (content.index('aria-label="second method"') < content.index("<nav")) is worse
    assert (tmp_path / "plots" / "second_method.svg").exists() is worse
    assert ("<h1>None of 3 places is good under both" in content) is worse
    assert ("<h1>Wear one station for walking: pelvis" in content) is not worse
    text = placement_text(findings)
    row = next(line for line in text.splitlines() if "+1.25 (+0.50 to +2.00)" in line)
    assert re.match(r"1 +pelvis +right hand .*" + ("yes +none" if worse else "no"), row)


def test_the_body_wears_what_is_good_under_both_methods(placement: PlacementFindings, tmp_path: Path) -> None:
    own = SetError(("left_hand",), 3.1, 2.0, 4.0, 16)
    choice = SecondChoice(("pelvis",), ("left_hand",), 1.25, 0.5, 2.0, worse=True, of=3, units=16, shared=own)
    advice = PlacementAdvice(SetError(("pelvis",), 3.0, 2.0, 4.0, 16), "smallest", (("left_hand",),), of=3)
    write_placement(
        tmp_path / "findings.json", replace(placement, second=SecondMethod("ridge", (choice,)), advice=advice)
    )
    content = write_placement_page(tmp_path).read_text(encoding="utf-8")
    assert re.search("<h1>Wear [^<]*left hand, good under both methods", content)
    assert "The body with the recommended stations left hand" in content
    text = text_of(tmp_path / "report.html")
    assert re.search(r"yes\s+left hand\s+16", text)


def test_without_held_out_clips_the_cross_validated_error_is_beside_the_error(placement: PlacementFindings) -> None:
    text = placement_text(placement)
    head = next(line for line in text.splitlines() if line.startswith("stations  best set"))
    assert "cross-validated" in head
    assert str(Interval.of(placement.best[0].cross_validated_error, None, None, "deg")) in text
    best = tuple(replace(each, held_out=3.21, held_out_low=3.0, held_out_high=3.5) for each in placement.best)
    held_out = placement_text(replace(placement, best=best))
    assert "cross-validated" not in held_out.split("\n\n")[1]
    assert "3.21 deg (3.00 to 3.50)" in held_out
