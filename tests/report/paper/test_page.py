"""The page of a paper: its first sentence, the content of each claim, and its safety."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.cli import main
from harness.core.number_format import Interval
from harness.errors import BadFile
from harness.report.kit.statement_lines import MARKS
from harness.report.paper.page import KINDS, claims_sentence, count_verdicts, run_link, write_paper_page
from harness.results.findings import (
    BarChart,
    BenchmarkStatement,
    FindingsTable,
    LineChart,
    PaperExperiment,
    PaperFindings,
)
from tests.report.paper.findings import curves, liu, sets, write_study
from tests.report.reading import read, text_of
from tests.results.rewrite import read_json, write_json

HOSTILE = "<script>alert(1)</script>&\"'$x^2$ <!-- end of paper --> ```"
EMPTY = PaperExperiment("empty", "Nothing", "", ())


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with one of its two runs, and its page."""
    folder = write_study(tmp_path_factory.mktemp("paper") / "liu", liu())
    (folder / "leave_one_out").mkdir()
    (folder / "leave_one_out" / "report.html").write_text("a run's page")
    write_paper_page(folder)
    return folder


def alone(folder: Path, *experiments: PaperExperiment) -> Path:
    """The page of a study of these experiments."""
    return write_paper_page(write_study(folder, replace(liu(), experiments=experiments, tables=())))


def test_the_page_opens_on_the_verdict(study: Path) -> None:
    page = (study / "report.html").read_text(encoding="utf-8")
    claims = [claim for experiment in liu().experiments for claim in experiment.claims]
    assert {claim.verdict for claim in claims} == set(KINDS) - {"same"}
    said = ", ".join(f"{sum(c.verdict == kind for c in claims)} {kind}" for kind in KINDS[1:] if kind != "same")
    reproduced = sum(claim.verdict == "reproduced" for claim in claims)
    assert f"<h1>{reproduced} of {len(claims)} printed statements reproduced, {said}.</h1>" in page
    assert page.index("<h1>") < page.index('class="tally"') < page.index("<nav") < page.index('class="claims"')


def test_every_claim_stands_in_the_table_with_both_figures_and_its_verdict(study: Path) -> None:
    """A verdict is shown as a word and a mark, not only by colour."""
    page = (study / "report.html").read_text(encoding="utf-8")
    rows = re.findall(r'<tr role="row"><th scope="row".*?</tr>', page[page.index('aria-label="claims"') :])
    claims = [claim for experiment in liu().experiments for claim in experiment.claims]
    assert len(rows) == len(claims)
    for row, claim in zip(rows, claims, strict=True):
        told = " ".join(re.sub(r"<[^>]*>", " ", row).replace("&#x27;", "'").split())
        for text in (claim.text, claim.target, claim.measured, claim.why, MARKS[claim.verdict], claim.verdict):
            assert text in told
        number = Interval.of(claim.value, claim.low, claim.high)
        assert number.ends in told
        if claim.low is None:
            assert " to " not in told.replace(claim.text, "")


def test_every_experiment_has_a_section_that_the_contents_lead_to(study: Path) -> None:
    reader = read(study / "report.html")
    ids = [attributes["id"] for _, attributes in reader.found if "id" in attributes]
    assert len(ids) == len(set(ids))
    targets = [str(a["href"])[1:] for tag, a in reader.found if tag == "a" and str(a["href"]).startswith("#")]
    assert set(targets) <= set(ids)
    assert {f"experiment-{experiment.name}" for experiment in liu().experiments} <= set(targets)


def test_what_several_experiments_differ_in_is_told_once(study: Path) -> None:
    said = text_of(study / "report.html")
    assert said.count("The motion comes from a generator") == 1
    assert said.count("Golf has 2 clips only.") == 1
    assert said.count("differences of several experiments") == 2


def test_figures_are_told_in_words_and_kept_as_files(study: Path) -> None:
    images = [attributes for tag, attributes in read(study / "report.html").found if tag == "img"]
    figures = [figure for experiment in liu().experiments for figure in experiment.figures]
    assert len(images) == len(figures)
    assert "walking: dynamic_map" not in str(images[0]["alt"]), "too many numbers to be listened to"
    mean = np.mean([value for value in curves(400).series["ik"] if value is not None])
    assert str(images[1]["alt"]).endswith(f", ik {mean:.2f}.")
    assert "positions: dynamic_map not measured, published 2.52" in str(images[2]["alt"])
    names = {path.name for path in (study / "plots").iterdir()}
    assert names == {f"{n}_1.{kind}" for n in ("leave_one_out", "frame_by_frame", "inputs") for kind in ("svg", "png")}
    assert all((study / "plots" / n).read_bytes()[:8] == b"\x89PNG\r\n\x1a\n" for n in names if n.endswith("png"))


def test_runs_are_linked_where_they_are(study: Path) -> None:
    links = [str(attributes["href"]) for tag, attributes in read(study / "report.html").found if tag == "a"]
    assert [link for link in links if not link.startswith("#")] == ["./leave_one_out/report.html"]
    assert "not_there" in text_of(study / "report.html")


@pytest.mark.parametrize("name", ["..", "../other", "/etc", "javascript:alert(1)", "out", "", "a\0b"])
def test_no_link_leaves_the_folder(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "study"
    (tmp_path / "other").mkdir()
    folder.mkdir()
    (folder / "out").symlink_to(tmp_path / "other")
    assert run_link(folder, name) is None


def test_a_run_s_folder_without_a_page_is_opened_itself(tmp_path: Path) -> None:
    (tmp_path / "a run").mkdir()
    page = alone(tmp_path, replace(EMPTY, runs=("a run",)))
    assert 'href="./a%20run/"' in page.read_text(encoding="utf-8")


def test_nothing_in_the_page_points_elsewhere(study: Path) -> None:
    page = (study / "report.html").read_text(encoding="utf-8")
    assert "default-src &#x27;none&#x27;" in page
    for target in re.findall(r"(?:src|href)=\"([^\"]*)\"", page):
        assert target.startswith(("data:", "#", "./")), target[:80]
    assert not re.search(r"url\(\s*['\"]?https?:|@import|<script[^>]* src", page)


def test_the_same_findings_give_the_same_bytes(study: Path) -> None:
    before = {path: path.read_bytes() for path in (study / "report.html", *(study / "plots").iterdir())}
    assert main(["report", str(study)]) == 0
    assert {path: path.read_bytes() for path in before} == before


def test_hostile_text_stays_text(tmp_path: Path) -> None:
    claim = BenchmarkStatement(HOSTILE, HOSTILE, HOSTILE, "not run", HOSTILE, 1, 0.5, 0.1, 0.9, HOSTILE)
    bars = BarChart(HOSTILE, HOSTILE, (HOSTILE, "b"), {HOSTILE: (1.0, None)}, caption=HOSTILE)
    lines = LineChart(HOSTILE, HOSTILE, HOSTILE, (0.0, 1.0), {HOSTILE: (1.0, 2.0)}, caption=HOSTILE)
    table = FindingsTable(HOSTILE, (HOSTILE, HOSTILE), ((HOSTILE, HOSTILE),))
    hostile = PaperExperiment(
        HOSTILE, HOSTILE, HOSTILE, (HOSTILE,), (claim,), (table,), (bars, lines), (HOSTILE,), (HOSTILE,)
    )
    findings = PaperFindings(
        HOSTILE,
        HOSTILE,
        HOSTILE,
        HOSTILE,
        1,
        (hostile, replace(hostile, name="b")),
        {HOSTILE: HOSTILE},
        tables=(table,),
    )
    page = write_paper_page(write_study(tmp_path, findings))
    raw = page.read_text(encoding="utf-8")
    assert "<script>alert" not in raw
    assert read(page).text.count(HOSTILE) > 20
    for plot in (tmp_path / "plots").glob("*.svg"):
        assert "<script" not in plot.read_text(encoding="utf-8")


def test_an_experiment_may_be_empty(tmp_path: Path) -> None:
    page = alone(
        tmp_path / "one", EMPTY, replace(EMPTY, name="table", tables=(FindingsTable("Errors", ("a", "b"), ()),))
    )
    said = text_of(page)
    assert "No published statement was compared with a measured result." in said
    assert "Errors: nothing was measured." in said
    assert "Circumstances" in text_of(alone(tmp_path / "none"))


def test_what_was_not_measured_is_said(tmp_path: Path) -> None:
    bars = BarChart("Bars", "deg", ("a", "b"), {"ik": (None, None), "pca": (1.0, None)}, spread={"pca": (None, None)})
    lines = LineChart("Lines", "x", "y", (0.0, 1.0, 2.0), {"ik": (None, None, None), "pca": (1.0, None, 3.0)})
    none = BarChart("No bars", "deg", (), {})
    page = alone(tmp_path, replace(EMPTY, figures=(bars, lines, none, LineChart("No lines", "x", "y", (), {}))))
    said = text_of(page)
    assert said.count("not measured") >= 3
    assert "A dash: not measured." in said
    assert "0 of 3" in said
    assert "nan" not in said.lower().split()


def test_what_has_nothing_to_draw_is_said_and_not_drawn(tmp_path: Path) -> None:
    none: dict[str, tuple[float | None, ...]] = {"ik": (None, None)}
    bars, lines = BarChart("Bars", "deg", ("a", "b"), none), LineChart("Lines", "x", "y", (0.0, 1.0), none)
    page = alone(tmp_path, replace(EMPTY, figures=(bars, lines, sets("walking"))))
    assert {path.name for path in (tmp_path / "plots").iterdir()} == {"empty_3.svg", "empty_3.png"}
    said = text_of(page)
    assert "Bars [deg]: nothing was measured." in said
    assert "Lines: y: nothing was measured." in said


def test_words_stand_on_the_left_of_their_column_and_numbers_on_the_right(tmp_path: Path) -> None:
    """A cell that begins with a number and continues with words is text."""
    rows = (("a", "1.2 ± 0.4 (8)", "8: one, two, three, four, five, six, seven"), ("b", "not measured", "none"))
    page = alone(tmp_path, replace(EMPTY, tables=(FindingsTable("Errors", ("a", "b", "c"), rows),)))
    words = re.findall(r'<span class="words"[^>]*>([^<]*)<', page.read_text(encoding="utf-8"))
    assert words == ["c", rows[0][2], "none"]


def test_names_between_backticks_are_code(tmp_path: Path) -> None:
    page = alone(tmp_path, replace(EMPTY, question="`<ik>` is plain, `a` is not`"))
    assert "<p><code>&lt;ik&gt;</code> is plain, <code>a</code> is not`</p>" in page.read_text()


def test_very_long_names_do_not_break_the_page(tmp_path: Path) -> None:
    long = "a_name_without_end_" * 12
    bars = BarChart("Bars", "deg", (long, "b"), {long: (1.0, 2.0), f"{long}2": (1.0, 2.0)})
    lines = LineChart("Lines", "x", "y", (0.0, 1.0), {long: (1.0, 2.0), f"{long}2": (1.0, 2.0)})
    claim = BenchmarkStatement(long, long, long, "cannot tell", long, 3)
    page = alone(tmp_path, replace(EMPTY, title=long, claims=(claim,), figures=(bars, lines)))
    assert text_of(page).count(long) >= 8


def test_old_plots_go(tmp_path: Path) -> None:
    alone(tmp_path, replace(EMPTY, figures=(curves(10), sets("walking"))))
    assert len(list((tmp_path / "plots").iterdir())) == 4
    alone(tmp_path, EMPTY)
    assert not list((tmp_path / "plots").iterdir())


def test_a_folder_without_findings_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadFile, match=r"findings\.json"):
        write_paper_page(tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_table_that_is_none_is_refused(tmp_path: Path) -> None:
    folder = write_study(tmp_path, liu())
    content = read_json(folder / "findings.json")
    content["tables"][0]["rows"][0].append("one more")
    write_json(folder / "findings.json", content)
    with pytest.raises(BadFile, match="a row of 3 texts under 2 columns"):
        write_paper_page(folder)


def test_the_sentence_counts_every_claim() -> None:
    claims = [BenchmarkStatement("", "", "", verdict) for verdict in KINDS for _ in range(3)]
    for count in range(len(claims) + 1):
        some = claims[:count]
        numbers = [int(number) for number in re.findall(r"\d+", claims_sentence(some))]
        assert sum(count_verdicts(some).values()) == count
        assert numbers == [] if not count else numbers[1] == count == sum(numbers) - numbers[1]


def test_printed_statements_have_both_readings_in_one_row(study: Path) -> None:
    page = (study / "report.html").read_text(encoding="utf-8")
    table = page[page.index('aria-label="printed statements"') : page.index('aria-label="claims"')]
    rows = re.findall(r'<tr role="row"><th scope="row".*?</tr>', table)
    assert len(rows) == len({c.text for e in liu().experiments for c in e.claims if c.kind == "printed"})
    assert all(row.count("<td") == 3 for row in rows)


def test_edited_findings_are_refused(tmp_path: Path) -> None:
    """A verdict that was turned by hand."""
    folder = write_study(tmp_path, liu())
    path = folder / "findings.json"
    before = path.read_text()
    path.write_text(before.replace('"not reproduced"', '"reproduced"', 1))
    assert path.read_text() != before
    with pytest.raises(BadFile, match=r"findings\.json: damaged or edited.*Give the command of the study again"):
        write_paper_page(folder)
