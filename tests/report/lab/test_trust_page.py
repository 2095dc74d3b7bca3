"""The page of a trust study: the verdict comes first, and both sides of each pair stand side by side."""

from pathlib import Path

import pytest

from harness.errors import Outcome
from harness.report.kit.page_html import write_page
from harness.report.kit.page_text import page_text
from harness.report.lab.trust_page import OUTCOME_TITLES, correlations, count_pairs, trust_page, verdict_sentence
from harness.results.trust_findings import TrustFindings
from tests.report.fabricate_trust import empty_trust, made_up_trust, trust_of
from tests.report.reading import read, text_of

COMMAND = "harness trust plan.toml walk_00.is900rec"
FAILED = {"ik on walking": "it crashed"}


def written(folder: Path, findings: TrustFindings) -> Path:
    return write_page(trust_page(findings, COMMAND), folder / "new" / "trust.html")


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return written(tmp_path_factory.mktemp("trust"), made_up_trust())


def section_ids(page: Path) -> list[str]:
    return [str(attributes["id"]) for name, attributes in read(page).found if name == "section"]


def test_the_verdict_is_the_first_thing(page: Path) -> None:
    text = text_of(page)
    word, sentence = text.index("Contradicted"), text.index(verdict_sentence(made_up_trust()))
    assert word < sentence < text.index("One pair contradicts") < text.index("1 ✗ contradict both sides")
    assert "4 ✓ agree" in text
    assert "unit.toml, digest ab12ab12ab12" in text
    assert "digest 5d1f5d1f5d1f" in text
    assert "Exploratory" not in text
    assert COMMAND in text


@pytest.mark.parametrize("outcome", OUTCOME_TITLES)
def test_every_outcome_has_its_word(outcome: Outcome, tmp_path: Path) -> None:
    page = written(tmp_path, trust_of(outcome, failures=FAILED))
    assert f" {OUTCOME_TITLES[outcome]} " in text_of(page)
    assert ("span", {"class": f"big {outcome.word.replace(' ', '_')}"}) in read(page).found


@pytest.mark.parametrize(
    ("findings", "figures"),
    [
        (made_up_trust(), ("1 of 6 pairs", "(local_pca against dynamic_map)", "1 of 4 metrics")),
        (trust_of(Outcome.REGRESSED, pairs=made_up_trust().pairs[:1]), ("1 of 4 metrics (dynamic_map",)),
        (trust_of(Outcome.REGRESSED, equivalences=()), ("1 of 6 pairs of methods",)),
        (trust_of(Outcome.PASS, pairs=made_up_trust().pairs[:2]), ("2 pairs of methods on 8 clips, none",)),
        (trust_of(Outcome.INCOMPLETE, failures=FAILED), ("incomplete: 1 cell failed (ik on walking)",)),
        (trust_of(Outcome.NOT_COMPARABLE), ("cannot be told", "1 of 6 pairs of methods on 8 clips")),
        (empty_trust(), ("cannot be told", "nothing was compared")),
    ],
)
def test_each_outcome_has_its_figures(findings: TrustFindings, figures: tuple[str, ...]) -> None:
    assert [text for text in figures if text not in verdict_sentence(findings)] == []


def test_an_exploratory_study_says_so(tmp_path: Path) -> None:
    exploratory = trust_of(Outcome.PASS, exploratory=True, plan_digest="aa")
    text = text_of(written(tmp_path, exploratory))
    assert "Exploratory: " in text
    assert "2,400 another plan 0f0f0f0f0f0f" in text
    assert "Exploratory: " in page_text(trust_page(exploratory, COMMAND))
    assert "noise default" in page_text(trust_page(trust_of(Outcome.PASS, unit="default", unit_digest=""), COMMAND))


def test_sections_with_charts_and_numbers(page: Path) -> None:
    assert section_ids(page) == ["pairs", "ranks", "equivalence", "distances", "health", "captures", "command"]
    pictures = [a for name, a in read(page).found if name in ("img", "svg") and (a.get("alt") or a.get("aria-label"))]
    assert len(pictures) == 4
    assert text_of(page).count("Numbers of this chart") == 2
    assert correlations(made_up_trust()) == [
        "Kendall's tau-b 0.67 (0.33 to 1.00).",
        "Sim-to-real correlation: not measured (2 arms and 8 clips).",
    ]


def test_both_sides_of_a_pair_stand_side_by_side(page: Path) -> None:
    assert count_pairs(made_up_trust().pairs) == {"contradict": 1, "cannot tell": 1, "agree": 4}
    text = text_of(page)
    pair = "local_pca against dynamic_map ✗ contradict each side shows the other order"
    assert f"{pair} −0.7 −1.1 to −0.3 +0.9 +0.5 to +1.3 0.024 8" in text
    assert text.index(pair) < text.index("local_pca against kernel_cca ? cannot tell no significant difference")


def test_numbers_of_the_other_sections(page: Path) -> None:
    text = text_of(page)
    assert "dynamic_map joint angle error [deg] ✗ beyond the margin 9.8 8.4 −1.4 −1.7 to −1.1 1 8" in text
    assert "left_wrist position error [mm] 0.91 0.35 0.006 40 and 200 of 5.2 s differs" in text
    assert "head orientation error [deg] 0.0115 0.0286 0.006 40 and 200 of 5.2 s differs by less than halves" in text
    assert "right_wrist position error [mm] −0.02" in text
    assert "pelvis orientation error [deg] not measured not measured – 3 and 200 of 5.2 s 3 blocks" in text
    assert "head device 40.00 1.20 % 3.10 0.210 0.930 0.10 %" in text
    assert "head simulation 40.00 1.00 % 2.80 – 0.940 0.00 %" in text
    assert "walk_00.is900rec walking_p00 2,400 yes 0f0f0f0f0f0f" in text


def test_an_empty_study_makes_a_page(tmp_path: Path) -> None:
    page = written(tmp_path, empty_trust())
    assert section_ids(page) == ["command"]
    assert "nothing was compared" in text_of(page)


def test_the_same_findings_give_the_same_bytes(page: Path, tmp_path: Path) -> None:
    assert written(tmp_path, made_up_trust()).read_bytes() == page.read_bytes()


def test_the_terminal_has_the_verdict_first_and_all_numbers() -> None:
    lines = page_text(trust_page(trust_of(Outcome.INCOMPLETE, failures=FAILED), COMMAND)).splitlines()
    assert lines[0] == "The study is incomplete: 1 cell failed (ik on walking)."
    assert max(map(len, lines)) <= 118
    for title in ("pairs", "margins", "distance of the errors", "stream health", "captures"):
        assert lines[lines.index(title) - 1] == ""
    text = "\n".join(lines)
    for number in ("−0.7 (−1.1 to −0.3)", "−1.4 (−1.7 to −1.1)", "0.67 (0.33 to 1.00)", "ik on walking: it crashed"):
        assert number in text
    assert "Two stations" in text
