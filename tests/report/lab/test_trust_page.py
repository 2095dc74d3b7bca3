"""The page of a trust study: the verdict comes first, both sides of each pair stand side by side."""

from pathlib import Path

import pytest

from harness.errors import Outcome
from harness.report.lab.trust_page import write_trust_page
from harness.report.lab.trust_text import format_trust
from harness.report.lab.trust_wording import OUTCOME_TITLES, verdict_sentence
from tests.report.fabricate_trust import empty_trust, made_up_trust, trust_of
from tests.report.reading import read, text_of


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_trust_page(tmp_path_factory.mktemp("trust") / "new" / "trust.html", made_up_trust())


def section_ids(page: Path) -> list[str]:
    return [str(attributes["id"]) for name, attributes in read(page).found if name == "section"]


def test_the_verdict_is_the_first_thing(page: Path) -> None:
    text = text_of(page)
    word, sentence = text.index("Contradicted"), text.index(verdict_sentence(made_up_trust().findings))
    assert word < sentence < text.index("One pair contradicts") < text.index("1 ✗ contradict both sides")
    assert "4 ✓ agree" in text
    assert "Simulated with unit.toml, digest ab12ab12ab12" in text
    assert "Plan digest 5d1f5d1f5d1f Level" in text
    assert "Exploratory" not in text


@pytest.mark.parametrize("outcome", OUTCOME_TITLES)
def test_every_outcome_has_its_word(outcome: Outcome, tmp_path: Path) -> None:
    page = write_trust_page(tmp_path / "page.html", trust_of(outcome, failures={"ik on walking": "it crashed"}))
    assert f" {OUTCOME_TITLES[outcome]} " in text_of(page)
    assert ("span", {"class": f"big {outcome.word.replace(' ', '_')}"}) in read(page).found


def test_an_exploratory_study_says_so(tmp_path: Path) -> None:
    text = text_of(write_trust_page(tmp_path / "page.html", trust_of(Outcome.PASS, exploratory=True, plan_digest="aa")))
    assert "Exploratory: captures were not made for this plan" in text
    assert "2,400 another plan 0f0f0f0f0f0f" in text
    preset = trust_of(Outcome.PASS, unit="default", unit_digest="")
    assert "Simulated with noise default Scenario" in text_of(write_trust_page(tmp_path / "preset.html", preset))


def test_sections_with_charts_and_numbers(page: Path) -> None:
    assert section_ids(page) == ["pairs", "ranks", "equivalence", "distances", "health", "captures", "command"]
    pictures = [a for name, a in read(page).found if name in ("img", "svg") and (a.get("alt") or a.get("aria-label"))]
    assert len(pictures) == 4
    text = text_of(page)
    assert text.count("Numbers of this chart") == 2
    assert "Kendall's tau-b 0.67 (0.33 to 1.00)." in text
    assert "Sim-to-real correlation: not measured (2 arms and 8 clips)." in text


def test_both_sides_of_a_pair_stand_side_by_side(page: Path) -> None:
    text = text_of(page)
    pair = "local_pca against dynamic_map ✗ contradict each side shows the other order"
    assert f"{pair} −0.70 −1.10 to −0.30 +0.90 +0.50 to +1.30 0.024 8" in text
    assert text.index(pair) < text.index("local_pca against kernel_cca ? cannot tell no significant difference")


def test_numbers_of_the_other_sections(page: Path) -> None:
    text = text_of(page)
    assert "dynamic_map joint angle error [deg] ✗ beyond the margin 9.80 8.40 −1.40 −1.70 to −1.10 1.00 8" in text
    assert "left_wrist position error [mm] 0.91 0.35 0.006 40 and 200 of 5.2 s differs" in text
    assert "head orientation error [deg] 0.0115 0.0286 0.006 40 and 200 of 5.2 s differs by less than halves" in text
    assert "right_wrist position error [mm] −0.02" in text
    assert "pelvis orientation error [deg] not measured not measured – 3 and 200 of 5.2 s 3 blocks" in text
    assert "head device 40.00 1.20 % 3.10 0.210 0.930 0.10 %" in text
    assert "head simulation 40.00 1.00 % 2.80 – 0.940 0.00 %" in text
    assert "walk_00.is900rec walking_p00 2,400 yes 0f0f0f0f0f0f" in text


def test_an_empty_study_makes_a_page(tmp_path: Path) -> None:
    page = write_trust_page(tmp_path / "page.html", empty_trust())
    assert section_ids(page) == ["command"]
    assert "nothing was compared" in text_of(page)


def test_the_same_report_gives_the_same_bytes(page: Path, tmp_path: Path) -> None:
    assert write_trust_page(tmp_path / "again.html", made_up_trust()).read_bytes() == page.read_bytes()


def test_the_text_has_the_verdict_first_and_fits_a_terminal() -> None:
    lines = format_trust(trust_of(Outcome.INCOMPLETE, failures={"ik on walking": "it crashed"})).splitlines()
    assert lines[0] == "The study is incomplete: 1 cell failed (ik on walking)."
    assert max(len(line) for line in lines if "  " in line) <= 118
    joined = "\n".join(lines)
    for title in ("pairs in joint angle error [deg]", "simulation minus device", "distance of the errors"):
        assert f"\n\n{title}\n" in joined
    assert "failed: ik on walking: it crashed" in joined
    assert "note: Two stations" in joined
    empty = format_trust(empty_trust()).splitlines()
    assert empty[1:] == [
        "no capture has a frame",
        "",
        "Walking with six stations: plan 5d1f5d1f5d1f, scenario walking",
        "simulated with unit.toml, digest ab12ab12ab12",
        "0 captures, 4 arms, 5 seeds, level 0.05",
    ]
    assert format_trust(trust_of(Outcome.PASS, exploratory=True)).startswith("Exploratory: ")
