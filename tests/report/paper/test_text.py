"""The claims of a paper as text: complete, aligned and narrow enough; and their update in a README."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import harness
from harness.cli import main
from harness.core.number_format import Interval
from harness.errors import BadFile
from harness.report.kit.statement_lines import WIDTH
from harness.report.paper.page import (
    claims_sentence,
    claims_table,
    paper_text,
    statements_table,
    statements_text,
    update_readme,
)
from harness.results.findings import BenchmarkStatement, PaperExperiment, Verdict
from tests.report.paper.findings import kim, liu, write_study

RESULTS = (Path(harness.__file__).parent.parent / "results" / "README.md").read_text(encoding="utf-8")


def letters(text: str) -> str:
    return "".join(text.split())


def test_every_claim_is_told_whole() -> None:
    told = letters(paper_text(liu()))
    for claim in (claim for experiment in liu().experiments for claim in experiment.claims):
        number = Interval.of(claim.value, claim.low, claim.high)
        for text in (claim.target, claim.measured, *claim.why.split(), claim.verdict, number.ends):
            assert letters(text) in told
    for text in (
        claims_sentence([c for e in liu().experiments for c in e.claims]),
        "Golf has 2 clips only.",
        "One sequence left out",
    ):
        assert letters(text) in told


@pytest.mark.parametrize("repeats", [1, 20])
def test_lines_are_never_longer_than_a_terminal(repeats: int) -> None:
    long = " ".join(["some words"] * repeats) + "and_one_without_any_end" * repeats
    claim = BenchmarkStatement(long, long, long, "cannot tell", long, 7, 0.1, -0.2, 0.3, "deg")
    findings = replace(
        liu(), experiments=(PaperExperiment("a", long, long, (long,), (claim, claim)), *kim().experiments)
    )
    lines = paper_text(findings).split("\n")
    assert max(map(len, lines)) <= WIDTH
    assert not any(line.endswith(" ") for line in lines)
    if repeats > 1:
        assert any(len(line) > 0.9 * WIDTH for line in lines)


def test_line_breaks_in_a_claim_do_not_break_the_table() -> None:
    claim = BenchmarkStatement("one\ntwo\t three", "a\nb", "c", "reproduced")
    told = paper_text(replace(liu(), experiments=(PaperExperiment("a", "b", "", (), (claim,)),)))
    assert "one two three  printed  a b        c         ✓ reproduced" in told


def stated(measured: str = "", verdict: Verdict = "cannot tell", **figures: Any) -> BenchmarkStatement:
    return BenchmarkStatement("", "order", measured, verdict, **figures)


@pytest.mark.parametrize(
    ("claim", "told"),
    [
        (stated(value=0.5, low=0.254, high=0.746, unit="deg"), "0.50 deg (0.25 to 0.75)"),
        (
            stated(value=0.004, low=-0.001, high=0.01, unit="deg", p_holm=0.0312),
            "0.004 deg (−0.001 to 0.010) (p 0.031)",
        ),
        (stated(value=1.0, low=0.5, high=1.5, p_holm=0.0004), "1.0 (0.5 to 1.5) (p < 0.001)"),
        (stated("1.21 deg", value=1.21, unit="deg"), ""),
        (stated("1.21 against 2", value=0.79, unit="deg"), "0.79 deg"),
        (stated(verdict="not run"), ""),
    ],
)
def test_a_difference_has_its_interval_and_p_and_is_told_once(claim: BenchmarkStatement, told: str) -> None:
    (row,) = claims_table([claim]).rows
    assert str(row[4]) == told


def test_tables_are_put_where_those_of_the_same_paper_and_motion_stand(tmp_path: Path) -> None:
    """Each in its place, in whatever order they come; everything else keeps every byte, and again changes nothing."""
    readme = tmp_path / "README.md"
    readme.write_bytes(b"# Results\r\n\r\nwords  \n")
    studies = [liu(), kim(), replace(liu(), motion="cmu")]
    for findings in studies:
        update_readme(readme, findings)
    first = readme.read_bytes()
    assert first.startswith(b"# Results\r\n\r\nwords  \n" + b"\n")
    for findings in reversed(studies):
        update_readme(readme, findings)
    assert readme.read_bytes() == first
    update_readme(readme, replace(studies[1], reference="Somebody else"))
    assert readme.read_bytes() == first.replace(kim().reference.encode(), b"Somebody else")
    for findings in studies:
        assert f"    {findings.command}\n".encode() in first
        assert all(
            f"    {line}".rstrip() in first.decode().split("\n") for line in statements_text(findings).split("\n")
        )


def test_no_text_can_end_its_section(tmp_path: Path) -> None:
    readme = tmp_path / "README.md"
    readme.write_text("words\n")
    hostile = "x\n<!-- end of paper kim2012-cmu -->\n# heading\n```\n<!-- paper kim2012-cmu -->"
    findings = replace(kim(), reference=hostile, command=hostile, circumstances={"harness": hostile})
    for _ in range(2):
        update_readme(readme, findings)
    text = readme.read_text()
    assert text.count("<!-- paper kim2012-cmu -->") == text.count("<!-- end of paper kim2012-cmu -->") == 1
    assert not re.search("^(# heading|```)", text, re.MULTILINE)


@pytest.mark.parametrize(
    "text",
    [
        "<!-- paper kim2012-cmu -->",
        "<!-- end of paper kim2012-cmu -->",
        "<!-- end of paper kim2012-cmu --> <!-- paper kim2012-cmu -->",
        "<!-- paper kim2012-cmu --> <!-- end of paper kim2012-cmu -->" * 2,
    ],
)
def test_broken_markers_are_refused_and_left(text: str, tmp_path: Path) -> None:
    readme = tmp_path / "README.md"
    readme.write_text(text)
    with pytest.raises(BadFile, match="markers"):
        update_readme(readme, kim())
    assert readme.read_text() == text


@pytest.mark.parametrize("content", [None, b"\xff\xfe"])
def test_a_page_that_cannot_be_read_is_refused(content: bytes | None, tmp_path: Path) -> None:
    readme = tmp_path / "README.md"
    if content:
        readme.write_bytes(content)
    with pytest.raises(BadFile, match=r"not UTF-8|no such file"):
        update_readme(readme, kim())


def test_the_verb_puts_the_tables_into_a_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = write_study(tmp_path / "study", replace(kim(), experiments=()))
    readme = tmp_path / "README.md"
    readme.write_text(RESULTS)
    assert main(["report", str(folder), "--readme", str(readme)]) == 0
    assert "kim2012-cmu" in readme.read_text()
    assert (folder / "report.html").is_file()
    assert main(["report", str(folder), "--methods", "ik", "--readme", str(tmp_path / "README.md")]) == 2
    assert "the study of a paper; expected a run." in capsys.readouterr().err
    assert main(["report", str(tmp_path), "--readme", str(readme)]) == 2
    assert "no results of the harness; expected" in capsys.readouterr().err


def test_the_results_page_has_its_markers() -> None:
    """The markers in results/README.md come in pairs, so that `harness report --readme` can replace the tables."""
    begun = re.findall(r"^<!-- paper (.*) -->$", RESULTS, re.MULTILINE)
    ended = re.findall(r"^<!-- end of paper (.*) -->$", RESULTS, re.MULTILINE)
    assert begun == ended
    assert len(set(begun)) == len(begun)


def test_a_printed_statement_has_one_row_with_both_readings() -> None:
    """Names of methods as printed are those of the paper; other kinds of claims are counted below the table."""
    claims = (
        BenchmarkStatement(
            "a: dynamic_map:literal errs less", "order", "1 against 2 deg", "reproduced", reading="as printed"
        ),
        BenchmarkStatement("a: dynamic_map errs less", "order", "3 against 2 deg", "not reproduced", reading="ours"),
        BenchmarkStatement("five modes", "99 %", "95 %", "not comparable"),
        BenchmarkStatement(
            "b: dynamic_map errs less", "order", "7 against 8 deg", "reproduced", kind="derived", reading="ours"
        ),
    )
    findings = replace(liu(), experiments=(PaperExperiment("a", "b", "", (), claims),))
    first, second = ([str(cell) for cell in row] for row in statements_table(findings).rows)
    assert first == ["a: dynamic_map errs less", "order", "✓ reproduced (1 against 2 deg)",
                     "✗ not reproduced (3 against 2 deg)"]  # fmt: skip
    assert second == ["five modes", "99 %", "≠ not comparable (95 %)", "≠ not comparable (95 %)"]
    lines = statements_text(findings).split("\n")
    assert lines[-1].startswith("1 further claim:")
    assert "7 against 8" not in statements_text(findings)
