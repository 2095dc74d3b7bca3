"""docs/papers.md agrees with the experiments and their scenarios."""

import importlib.util
import re
from pathlib import Path
from typing import Any

import pytest

import harness
from harness.report.kit import MARKS
from harness.report.paper.page import KINDS
from harness.results.findings import PaperExperiment
from harness.study.papers.paper import PAPERS, load_paper
from harness.study.papers.paper_study import PaperStudy

ROOT = Path(harness.__file__).parent.parent
PAGE = (ROOT / "docs" / "papers.md").read_text(encoding="utf-8")


def test_every_experiment_and_no_other_has_a_row() -> None:
    tables = re.findall(r"\| experiment \| the paper \| where \|\n\|---\|---\|---\|\n((?:\|.*\n)+)", PAGE)
    named = [re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE) for table in tables]
    assert named == [list(load_paper(name).experiments) for name in PAPERS]


def test_every_verdict_has_a_row() -> None:
    assert re.findall(r"^\| (\S) ([a-z ]+) \|", PAGE.split("## Reproduction")[1], re.MULTILINE) == [
        (MARKS[kind], kind) for kind in KINDS
    ]


def test_every_file_that_is_named_is_there() -> None:
    names = re.findall(r"`((?:harness|scenarios)/[a-z0-9_/.*]+)`", PAGE) + re.findall(r"\]\(([^)#]+)", PAGE)
    assert len(names) > 5
    for name in names:
        assert list(ROOT.glob(name)) or (ROOT / "docs" / name).exists(), name


def test_the_experiment_of_the_page_is_one(tmp_path: Path) -> None:
    """The experiment in the text runs; without results its claim is "not run"."""
    page = (ROOT / "docs" / "notes" / "paper_experiments.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    imports = (
        "from harness.results.findings.paper_findings import PaperExperiment\n"
        "from harness.study.papers.claims import claim_lower_error\n"
        "from harness.study.papers.paper_study import PaperStudy\n"
        "from harness.study.papers.tables import errors_by_unit, mean_bars\n\n\n"
    )
    file = tmp_path / "swords.py"
    file.write_text(imports + code)
    spec = importlib.util.spec_from_file_location("swords", file)
    assert spec is not None
    assert spec.loader is not None
    module: Any = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    found = module.swords(PaperStudy(tmp_path, "builtin", 1, {}))
    assert isinstance(found, PaperExperiment)
    assert [claim.verdict for claim in found.claims] == ["not run"]


@pytest.mark.parametrize("name", PAPERS)
def test_a_paper_s_runs_are_found_by_their_files(name: str) -> None:
    folder = ROOT / "scenarios" / "papers" / name
    for motion in ("builtin", "cmu"):
        files = {path.stem.removeprefix(f"{motion}_") for path in folder.glob(f"{motion}_*.toml")}
        assert set(load_paper(name).plan(motion, 1)) == files
        assert files
