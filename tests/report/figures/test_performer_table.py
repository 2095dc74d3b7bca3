"""The table of a README: each performer counts once, conditions are columns, and a command puts it into a page."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.cli import main
from harness.compare import mean_interval
from harness.report.figures.performer_table import PerformerColumn, performer_columns, table_lines, update_readme
from harness.results import ResultSet
from tests.compare.sides import cell, manifest, side, write_run
from tests.planted import Plan, planted_run

COMMAND = "harness run made_up --methods ik,expert_map --out /tmp/x --jobs 2 --no-report"


def test_three_clips_of_a_performer_are_one_unit(tmp_path: Path) -> None:
    """The mean of the performers' means: a performer with three clips weighs as much as one with a single clip."""
    clips = [f"walking_p{n}_01" for n in range(1, 8)] + ["walking_p1_02", "walking_p1_03@0.00-0.50"]
    cells = tuple(cell(clip, method) for clip in clips for method in ("ik", "mean_pose"))
    (column,) = performer_columns(write_run(tmp_path / "run", ResultSet("A", manifest(), cells, len(cells))))
    errors = {c.clip: float(c.metrics["joint_angle_mean_deg"] or 0.0) for c in cells if c.method == "ik"}
    first = float(np.mean([error for clip, error in errors.items() if "_p1_" in clip]))
    by_performer = [first, *(errors[f"walking_p{n}_01"] for n in range(2, 8))]
    low, high = mean_interval(np.array(by_performer))
    assert column.performers == 7
    assert column.text("ik") == f"{np.mean(by_performer):.2f} ({low:.2f} to {high:.2f})"


def test_bold_are_the_lowest_and_what_is_tied_with_it() -> None:
    units = [f"p{n}" for n in range(8)]
    factors = {"low": [1.0] * 8, "tied": [0.9, 1.1] * 4, "worse": [1.2, 1.3] * 4}
    errors = {name: dict(zip(units, values, strict=True)) for name, values in factors.items()}
    column = PerformerColumn("known", errors)
    assert [name for name in errors if column.text(name).startswith("**")] == ["low", "tied"]
    few = PerformerColumn("known", {name: dict(list(found.items())[:5]) for name, found in errors.items()})
    assert not any(few.text(name).startswith("**") for name in errors)
    assert few.text("absent") == "–"
    assert few.lowest_on() == "`tied` 3, `low` 2"
    (note,) = (" ".join(table_lines(columns, {})[7:]) for columns in [[column, few]])
    assert "Bold: the lowest mean" in note
    assert "Fewer than 6 performers cannot show a difference" in note


def test_a_column_is_named_by_what_tells_it_apart(tmp_path: Path) -> None:
    """A split that goes with the performers is not in the title; each column states its number of performers."""
    cells = [
        cell(f"boxing_p{n}_01", performer=performer, varied={"noise": noise, "motion.split": split}, noise=noise)
        for noise in ("clean", "default")
        for split, performer, count in (("subject", "new", 3), ("block", "known", 7))
        for n in range(count)
    ]
    out = write_run(tmp_path / "run", ResultSet("A", manifest(command=COMMAND), tuple(cells), len(cells)))
    page = tmp_path / "README.md"
    page.write_text("# Page\n")
    update_readme(page, out)
    lines = page.read_text().splitlines()
    assert lines[2] == "<!-- run made_up -->"
    assert lines[3] == "| method | known, clean | known, default | new, clean | new, default |"
    assert "| units (performers) | 7 | 7 | 3 | 3 |" in lines
    assert "`harness run made_up --methods ik,expert_map`" in " ".join(lines)
    assert max(map(len, lines)) <= 120


def test_a_second_update_replaces_the_first(tmp_path: Path) -> None:
    page = tmp_path / "README.md"
    page.write_text("before\n\n<!-- run made_up -->\nstale\n<!-- end of run made_up -->\n\nafter\n")
    update_readme(page, write_run(tmp_path / "run", replace(side(), manifest=manifest(command=COMMAND))))
    text = page.read_text()
    assert text.startswith("before\n\n<!-- run made_up -->\n| method |")
    assert text.endswith("<!-- end of run made_up -->\n\nafter\n")
    assert "stale" not in text


@pytest.mark.slow
def test_the_verb_puts_the_table_of_a_run_into_a_page(tmp_path: Path) -> None:
    out = planted_run(tmp_path / "run", Plan(behaviours=("walking",), takes=1, methods={"ik": 2.0, "mean_pose": 8.0}))
    page = tmp_path / "README.md"
    page.write_text("# Page\n")
    assert main(["report", str(out), "--readme", str(page), "--methods", "ik"]) == 0
    assert re.findall(r"^\| `(\w+)` \| \d", page.read_text(), re.MULTILINE) == ["ik"]
    assert (out / "report.html").is_file()
    before = page.read_bytes()
    assert main(["report", str(out), "--readme", str(page), "--methods", "other"]) == 2
    assert main(["report", str(out), "--methods", "ik"]) == 2
    assert page.read_bytes() == before
