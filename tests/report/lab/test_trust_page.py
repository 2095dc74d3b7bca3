"""The page of a trust study: the verdict comes first, and both sides of each pair stand side by side."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from harness.core.number_format import Interval, format_p_value
from harness.errors import Outcome
from harness.report.kit.page_html import write_page
from harness.report.kit.page_text import render_text
from harness.report.kit.text import metric_name
from harness.report.lab.trust_page import OUTCOME_TITLES, correlations, count_pairs, trust_page, verdict_sentence
from harness.results.findings import RankCorrelation, TrustFindings
from tests.report.reading import count_pictures, emptied, numbers_in_order, read, section_ids, text_of

pytestmark = pytest.mark.long
COMMAND = "harness trust plan.toml walk_00.rec"
FAILED = {"ik on walking": "it crashed"}


def contradicted(findings: TrustFindings, **changes: Any) -> TrustFindings:
    """The findings with another outcome, and the pair in which both sides agree turned on the device."""
    pairs = [replace(pair, verdict="contradict") if pair.verdict == "agree" else pair for pair in findings.pairs]
    return replace(findings, **{"pairs": tuple(pairs), "outcome": Outcome.REGRESSED, **changes})


@pytest.fixture(scope="module")
def empty(trust_findings: TrustFindings) -> TrustFindings:
    """A study in which nothing could be compared."""
    parts = ("captures", "health", "distances", "equivalences", "pairs", "rank_correlations", "notes")
    return replace(trust_findings, outcome=Outcome.NOT_COMPARABLE, why="no frame", **emptied(parts))


def written(folder: Path, findings: TrustFindings) -> Path:
    return write_page(trust_page(findings, COMMAND), folder / "new" / "trust.html")


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory, trust_findings: TrustFindings) -> Path:
    return written(tmp_path_factory.mktemp("trust"), trust_findings)


def test_the_verdict_is_the_first_thing(page: Path, trust_findings: TrustFindings) -> None:
    text = text_of(page)
    assert trust_findings.outcome is Outcome.REGRESSED
    counts = [
        f"{count} {mark} {kind} "
        for mark, (kind, count) in zip("✗?✓", count_pairs(trust_findings.pairs).items(), strict=True)
    ]
    assert numbers_in_order(text, "Differs", verdict_sentence(trust_findings), *counts)
    assert f"digest {trust_findings.plan_digest[:12]}" in text
    assert "noise default" in text
    assert "Exploratory" not in text
    assert COMMAND in text


@pytest.mark.parametrize("outcome", OUTCOME_TITLES)
def test_every_outcome_has_its_word(outcome: Outcome, tmp_path: Path, trust_findings: TrustFindings) -> None:
    page = written(tmp_path, replace(trust_findings, outcome=outcome, failures=FAILED))
    assert f" {OUTCOME_TITLES[outcome]} " in text_of(page)
    assert ("span", {"class": f"big {outcome.word.replace(' ', '_')}"}) in read(page).found


def test_each_outcome_has_its_figures(trust_findings: TrustFindings, empty: TrustFindings) -> None:
    found, turned = trust_findings, contradicted(trust_findings)
    beyond = [row for row in found.equivalences if row.verdict == "beyond the margin"]
    (pair,) = (one for one in turned.pairs if one.verdict == "contradict")
    margins = f"{len(beyond)} of 6 metrics ({metric_name(beyond[0].metric)} of {beyond[0].arm}; "
    for findings, figures in (
        (found, (margins,)),
        (turned, (f"1 of 3 pairs of methods ({pair.a} against {pair.b})", margins)),
        (replace(turned, equivalences=()), ("1 of 3 pairs",)),
        (replace(found, outcome=Outcome.PASS, why="all agree."), ("does (3 pairs of methods on 6 clips): all agree.",)),
        (replace(found, outcome=Outcome.INCOMPLETE, failures=FAILED), ("incomplete: 1 cell failed (ik on walking)",)),
        (
            replace(found, outcome=Outcome.NOT_COMPARABLE, why="too few units."),
            ("cannot be told", "(2 of 3 pairs of methods on 6 clips are undecided): too few units."),
        ),
        (empty, ("cannot be told", "nothing was compared")),
    ):
        assert [text for text in figures if text not in verdict_sentence(findings)] == []


def test_an_exploratory_study_says_so(tmp_path: Path, trust_findings: TrustFindings) -> None:
    exploratory = replace(trust_findings, exploratory=True, plan_digest="aa")
    text = text_of(written(tmp_path, exploratory))
    assert "Exploratory: " in text
    assert text.count("120 another plan ") == 6
    assert "Exploratory: " in render_text(trust_page(exploratory, COMMAND))
    unit = replace(trust_findings, unit="unit.toml", unit_digest="ab12" * 16)
    assert "unit.toml, digest ab12ab12ab12" in render_text(trust_page(unit, COMMAND))


def test_sections_with_charts_and_numbers(page: Path, trust_findings: TrustFindings) -> None:
    assert section_ids(page) == ["pairs", "ranks", "equivalence", "distances", "health", "captures", "command"]
    assert count_pictures(page) == 4
    assert text_of(page).count("Numbers of this chart") == 2
    tau, other = trust_findings.rank_correlations
    unknown = RankCorrelation(other.name, None, None, None, "2 arms and 8 clips")
    assert correlations(replace(trust_findings, rank_correlations=(tau, unknown))) == [
        f"Kendall's tau-b {Interval.of(tau.value, tau.low, tau.high)}.",
        "Sim-to-real correlation: not measured (2 arms and 8 clips).",
    ]


def signed(value: float | None, low: float | None, high: float | None) -> Interval:
    return Interval.of(value, low, high, signed=True)


def test_both_sides_of_a_pair_stand_side_by_side_contradictions_first(
    page: Path, trust_findings: TrustFindings, tmp_path: Path
) -> None:
    text = text_of(page)
    for pair in trust_findings.pairs:
        sides = [signed(side.mean, side.low, side.high) for side in (pair.device, pair.simulated)]
        name, p = f"{pair.a} against {pair.b}", format_p_value(pair.p_holm)
        assert numbers_in_order(text, name, pair.verdict, pair.why, *sides, p, f"{pair.clips}"), name
    turned = contradicted(trust_findings)
    first = text_of(written(tmp_path, turned)).partition(" verdict device simulation ")[2]
    assert numbers_in_order(first, "✗ contradict", "? cannot tell", "? cannot tell")


def test_numbers_of_the_other_sections(page: Path, trust_findings: TrustFindings) -> None:
    text = text_of(page)
    order = ("beyond the margin", "cannot tell", "equivalent")
    rows = sorted(trust_findings.equivalences, key=lambda row: order.index(row.verdict))
    assert {row.verdict for row in rows} == set(order)
    table = text[text.index(" method metric verdict ") :]
    assert numbers_in_order(
        table, *(x for row in rows for x in (row.arm, row.verdict, signed(row.difference, row.low, row.high), "6"))
    )
    for one in trust_findings.distances:
        factor = 1e3 if one.unit == "m" else 57.29577951308232
        number = f"{factor * float(one.distance or 0.0):.3g}".replace("-", "−")
        blocks = f"{one.blocks[0]} and {one.blocks[1]} of {one.block_s:.1f} s"
        differs = "differs" if one.p_holm is not None and one.p_holm <= 0.05 else "no difference shown"
        assert numbers_in_order(text, f"{one.station} {one.feature} ", number, blocks, differs), one
    for station in trust_findings.health:
        for side, health in (("device", station.device), ("simulation", station.simulated)):
            lost = f"{100.0 * health.lost_share:.2f} %"
            row = f"{station.station} {side} {health.rate_hz:.2f} {lost} {health.gaps_per_min:.2f} "
            gap = "–" if health.gap_s is None else f"{health.gap_s:.3f}"
            assert f"{row}{gap} {health.quality:.3f} {100.0 * health.suspect_share:.2f} %" in text
    for capture in trust_findings.captures:
        assert f"{capture.file} {capture.clip} 120 yes {capture.sha256[:12]}" in text


def test_an_empty_study_makes_a_page(tmp_path: Path, empty: TrustFindings) -> None:
    page = written(tmp_path, empty)
    assert section_ids(page) == ["command"]
    assert "nothing was compared" in text_of(page)


def test_the_same_findings_give_the_same_bytes(page: Path, tmp_path: Path, trust_findings: TrustFindings) -> None:
    assert written(tmp_path, trust_findings).read_bytes() == page.read_bytes()


def test_the_terminal_has_the_verdict_first_and_all_numbers(trust_findings: TrustFindings) -> None:
    failed = replace(trust_findings, outcome=Outcome.INCOMPLETE, failures=FAILED)
    lines = render_text(trust_page(failed, COMMAND)).splitlines()
    assert lines[0] == verdict_sentence(failed)
    assert max(map(len, lines)) <= 118
    for title in ("pairs", "margins", "distance of the errors", "stream health", "captures"):
        assert lines[lines.index(title) - 1] == ""
    text = " ".join(" ".join(lines).split())
    numbers = [signed(row.difference, row.low, row.high) for row in failed.equivalences if row.difference]
    numbers += [signed(pair.device.mean, pair.device.low, pair.device.high) for pair in failed.pairs]
    assert [str(number) for number in numbers if str(number) not in text] == []
    assert "ik on walking: it crashed" in text
    assert all(note in text for note in failed.notes)
