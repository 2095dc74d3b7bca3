"""Findings come back from their file as they went in; what is none is refused."""

from pathlib import Path

import pytest

from harness.errors import BadFile
from harness.results.files.digests import write_result_json
from harness.results.findings.benchmark_statement import BenchmarkStatement
from harness.results.findings.paper_findings import (
    BarChart,
    FindingsTable,
    LineChart,
    PaperExperiment,
    PaperFindings,
    read_findings,
    write_findings,
)

FINDINGS = PaperFindings(
    paper="liu2011",
    reference="Liu et al. 2011",
    motion="built-in performer",
    command="harness paper liu2011",
    seed=1,
    experiments=(
        PaperExperiment(
            name="inputs",
            title="Four choices of inputs",
            question="Which readings are needed?",
            differences=("other motion",),
            claims=(
                BenchmarkStatement(
                    "a errs less than b", "order", "-0.4 deg", "reproduced", clips=6, value=-0.4, unit="deg"
                ),
            ),
            tables=(FindingsTable("errors", ("method", "deg"), (("ik", "2.0"),)),),
            figures=(
                BarChart("errors", "deg", ("walking",), {"ik": (None,)}, low={"ik": (1.0,)}),
                LineChart("over time", "time [s]", "error [deg]", (0.0, 0.025), {"ik": (1.0, None)}),
            ),
            runs=("inputs",),
            notes=("a note",),
        ),
    ),
    circumstances={"commit": None, "packages": {"numpy": "2"}},
)


def test_findings_come_back_from_their_file(tmp_path: Path) -> None:
    write_findings(tmp_path / "findings.json", FINDINGS)
    assert read_findings(tmp_path / "findings.json") == FINDINGS


@pytest.mark.parametrize(
    ("old", "new"),
    [('"reproduced"', '"proved"'), ('"bars"', '"pie"'), ('"seed"', '"sead"'), ('"clips": 6', '"clips": "six"')],
)
def test_what_is_none_is_refused(tmp_path: Path, old: str, new: str) -> None:
    path = tmp_path / "findings.json"
    write_findings(path, FINDINGS)
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(BadFile, match=r"findings\.json"):
        read_findings(path)


@pytest.mark.parametrize("other", [{"paper": "kim2012"}, {"seed": 2}, {"motion": "cmu"}])
def test_findings_of_another_study_are_refused(tmp_path: Path, other: dict[str, str | int]) -> None:
    """A findings.json that was copied into the folder of another study fits its own digest."""
    identity = {"paper": "liu2011", "motion": "built-in performer", "seed": 1}
    write_findings(tmp_path / "findings.json", FINDINGS)
    write_result_json(tmp_path / "study.json", identity)
    assert read_findings(tmp_path / "findings.json") == FINDINGS
    write_result_json(tmp_path / "study.json", {**identity, **other})
    with pytest.raises(BadFile, match=r"as study\.json says, of"):
        read_findings(tmp_path / "findings.json")
