"""The page of a run: its content, its safety, and what remains when pictures cannot be rendered."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from harness.compare import compare_runs
from harness.errors import BadFile
from harness.report.kit import render_process
from harness.report.kit.document import picture_uri
from harness.report.kit.page import DataTable, Strong
from harness.report.run import page as run_page
from harness.report.run.data import WORST_METRICS, read_run
from harness.report.run.headline import run_verdict
from harness.report.run.page import write_run_page
from harness.report.run.tables import results_tables
from harness.report.run.text import run_table
from harness.results import read_summary
from tests.planted import METHODS, Plan, planted_run

HOSTILE = "<script>alert(1)</script>&\"'$x^2$"


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of two behaviours and four methods with its page, without rendering."""
    out = planted_run(tmp_path_factory.mktemp("report") / "run")
    write_run_page(out, rendered=False)
    return out


def text_of(page: Path) -> str:
    """The text of the page without scripts and tags, with single blanks."""
    content = re.sub(r"<(script|style)\b.*?</\1>", " ", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    return re.sub(r"\s+", " ", re.sub(r"<[^>]*>", " ", content))


def verdict_of(page: str) -> tuple[str, str]:
    """The heading, and the sentences below it."""
    heading, rest = re.search(r"<h1>(.*?)</h1>", page), re.search(r'<p class="verdict-text">(.*?)</p>', page)
    assert heading is not None
    assert rest is not None
    return heading[1], rest[1]


def test_the_page_opens_on_the_verdict(run_folder: Path) -> None:
    page = (run_folder / "report.html").read_text(encoding="utf-8")
    heading, _ = verdict_of(page)
    assert page.index("<h1>") < page.index("<table")
    assert heading.startswith("best_match+ik has the lowest mean joint-angle error, ")
    assert "on 2 sequences of 1 performer of built-in motion" in heading
    assert "cannot be called better than any of the other 3 (too few units: 1, of at least 6)." in heading
    assert "<td><strong>" not in page
    assert "Bold: " not in page


def test_the_verdicts_numbers_are_those_of_the_summary(run_folder: Path) -> None:
    rows = json.loads((run_folder / "summary.json").read_text())["cells"]
    means = {name: np.mean([row["joint_angle_mean_deg"] for row in rows if row["method"] == name]) for name in METHODS}
    assert f"error, {min(means.values()):.2f}° on" in run_verdict(read_run(run_folder))[0]


@pytest.fixture(scope="module")
def ten_clips(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run in which one method is better than two that are alike."""
    plan = Plan(behaviours=("walking",), methods={"poor": 4.0, "good": 1.0, "other": 4.0}, takes=10, duration_s=2.0)
    return planted_run(tmp_path_factory.mktemp("ten") / "run", plan)


def test_headline_bold_cells_terminal_and_comparison_agree(ten_clips: Path) -> None:
    """Where a method is best, the comparison of two says so, and its cells alone are bold."""
    page = write_run_page(ten_clips, rendered=False).read_text(encoding="utf-8")
    rows = json.loads((ten_clips / "summary.json").read_text())
    errors = {row["method"]: row["metrics"]["joint_angle_mean_deg"]["mean"] for row in rows["methods"]}
    poor = min(("poor", "other"), key=lambda name: errors[name])
    heading, rest = verdict_of(page)
    less = f"That is {errors[poor] - errors['good']:.2f}° ({100 * (1 - errors['good'] / errors[poor]):.0f} %) less than"
    assert heading.startswith(f"good is best: {errors['good']:.2f}° mean joint-angle error on 10 sequences of ")
    assert rest.startswith(f"{less} {poor}, the next, and lower on 10 of 10 performers.")
    assert "good is best: " in run_table(read_summary(ten_clips))
    for other in ("poor", "other"):
        line = compare_runs(ten_clips, methods=(other, "good")).differences[0]
        assert (line.metric, line.verdict) == ("joint_angle_mean_deg", "better")
    bold = re.findall(r"<td><strong>([\d.]+)", page)
    assert f"{errors['good']:.2f}" in bold
    assert f"{errors['poor']:.2f}" not in bold
    assert "Mean ± sd over n sequences. Bold: better than every other method" in page


def test_methods_that_cannot_be_told_apart_are_not_ranked(ten_clips: Path) -> None:
    line = compare_runs(ten_clips, methods=("poor", "other")).differences[0]
    assert line.verdict == "cannot tell"
    summary = read_summary(ten_clips)
    for name in ("methods", "behaviours", "cells"):
        summary[name] = [row for row in summary[name] if row["method"] != "good"]
    run = replace(read_run(ten_clips), summary=summary, full_summary=summary)
    lowest, _ = run.ranked
    sentence, _ = run_verdict(run)
    assert sentence.startswith(f"{lowest} has the lowest mean joint-angle error, ")
    assert f"cannot be called better than the other method ({line.why})." in sentence
    tables = [block for block in results_tables(run) if isinstance(block, DataTable)]
    assert not any(isinstance(cell, Strong) for table in tables for row in table.rows for cell in row)


def test_identical_methods_are_the_same(tmp_path: Path) -> None:
    """Two names of the same code on five clips."""
    out = planted_run(tmp_path / "run", Plan(behaviours=("walking",), methods={"ik": 1.0}, takes=5, duration_s=2.0))
    summary = read_summary(out)
    for name in ("methods", "behaviours", "cells"):
        summary[name] = [{**row, "method": method} for method in ("ik", "copy") for row in summary[name]]
    sentence, _ = run_verdict(replace(read_run(out), summary=summary, full_summary=summary))
    assert "The same within the margin: copy." in sentence
    assert "best" not in sentence


def test_the_verdict_says_when_positions_tell_another_story(run_folder: Path) -> None:
    run = read_run(run_folder)
    assert run_verdict(run)[0].endswith(" mm, also the lowest.")
    cells = [{**row, "mpjpe_mm": 1.0 if row["method"] == "ik" else 60.0} for row in run.cells]
    told, _ = run_verdict(replace(run, summary={**run.summary, "cells": cells}))
    assert told.endswith("ik has the lowest joint position error: 1 mm (best_match+ik: 60 mm).")


def test_methods_without_a_common_sequence_are_not_ranked(run_folder: Path) -> None:
    run = read_run(run_folder)
    cells = [row for row in run.cells if (row["method"] == "ik") == (row["behaviour"] == "walking")]
    verdict, lowest = run_verdict(replace(run, full_summary={**run.summary, "cells": cells}))
    assert lowest is None
    assert verdict.endswith("share no measured sequence, so they are not ranked.")


def test_every_number_of_the_table_is_in_the_summary(run_folder: Path) -> None:
    said = text_of(run_folder / "report.html")
    for row in json.loads((run_folder / "summary.json").read_text())["behaviours"]:
        for metric, decimals in (("joint_angle_mean_deg", 2), ("mpjpe_mm", 1)):
            assert f" {row['metrics'][metric]['mean']:.{decimals}f} " in said


def test_the_page_says_what_was_run_and_how_to_run_it_again(run_folder: Path) -> None:
    said = text_of(run_folder / "report.html")
    assert "built-in performer (generated by a procedure, not recorded from a person); walking, boxing" in said
    assert "320 of 320 frames matched (100.0 %); 8 of 8 cells finished" in said
    assert re.search(r"harness run \S+run\.toml --out \S+run --no-report|harness .*", said)
    assert "calibration exact" in said


def test_pictures_that_were_not_asked_for_are_named_as_missing(run_folder: Path) -> None:
    assert "Rendered pictures of the worst two seconds: rendering was turned off" in text_of(run_folder / "report.html")
    assert not list((run_folder / "plots").glob("*.png"))


def test_plots_lie_beside_the_page(run_folder: Path) -> None:
    names = {path.name for path in (run_folder / "plots").iterdir()}
    assert names == {
        "error_walking.svg",
        "error_boxing.svg",
        "joints_body.svg",
        "per_joint.svg",
        "ranking_1.svg",
        "error_cdf.svg",
        *(f"loss_{name}.svg" for name in ("ik", "best_match", "mean_pose")),
    }


def test_nothing_in_the_page_points_elsewhere(run_folder: Path) -> None:
    page = re.sub(r"<script type=\"text/plain\".*?</script>", "", (run_folder / "report.html").read_text(), flags=re.S)
    assert "default-src &#x27;none&#x27;" in page
    for target in re.findall(r"(?:src|href)=\"([^\"]*)\"", page):
        assert target.startswith(("data:", "#")), target[:80]
    assert not re.search(r"url\(\s*['\"]?https?:", page)


def test_the_same_run_gives_the_same_page(run_folder: Path) -> None:
    before = (run_folder / "report.html").read_bytes()
    write_run_page(run_folder, rendered=False)
    assert (run_folder / "report.html").read_bytes() == before


def rename(row: dict[str, Any]) -> dict[str, Any]:
    return {key: HOSTILE if key in ("clip", "behaviour") else value for key, value in row.items()}


def test_hostile_names_stay_text(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Names of a library's clips and behaviours are a user's."""
    out = planted_run(tmp_path / "run", Plan(behaviours=("walking",), methods={"ik": 2.0, "mean_pose": 3.0}))
    run = read_run(out)
    rows = {name: [rename(row) for row in run.summary[name]] for name in ("behaviours", "cells", "methods")}
    traces = tuple(replace(trace, clip=HOSTILE, behaviour=HOSTILE) for trace in run.traces)
    monkeypatch.setattr(
        run_page,
        "read_run",
        lambda *_: replace(run, summary={**run.summary, **rows}, full_summary={**run.summary, **rows}, traces=traces),
    )
    page = write_run_page(out, rendered=False).read_text(encoding="utf-8")
    assert "<script>alert" not in page
    assert "&lt;script&gt;alert(1)&lt;/script&gt;&amp;&quot;&#x27;$x^2$" in page
    for chart in (tmp_path / "run" / "plots").glob("*.svg"):
        assert "<script" not in chart.read_text(encoding="utf-8")


def test_what_failed_and_what_was_not_measured_is_said(tmp_path: Path) -> None:
    plan = Plan(behaviours=("walking",), duration_s=2.0, failing=("mean_pose",), covered=0.2)
    page = write_run_page(planted_run(tmp_path / "run", plan), rendered=False)
    said = text_of(page)
    assert "Nothing was measured: 3 of 4 cells finished." in said
    assert "ValueError: &lt;b&gt;no&lt;/b&gt; pose &amp; no plan" in page.read_text(encoding="utf-8")
    table = re.search(r"joint_angle_mean_deg \[deg\](.*?)mpjpe_mm \[mm\]", said)
    assert table is not None
    assert table[1].count("not measured") == 3
    assert "metrics in some cells" in said


def test_a_run_without_any_finished_cell_has_a_page(tmp_path: Path) -> None:
    plan = Plan(behaviours=("walking",), duration_s=2.0, failing=tuple(METHODS))
    said = text_of(write_run_page(planted_run(tmp_path / "run", plan)))
    assert "Nothing was measured: 0 of 4 cells finished." in said
    assert said.count("ValueError") >= 4


def test_a_perfect_method_breaks_no_axis(tmp_path: Path) -> None:
    plan = Plan(behaviours=("walking",), methods={"oracle": 0.0}, duration_s=2.0)
    said = text_of(write_run_page(planted_run(tmp_path / "run", plan), rendered=False))
    assert "oracle: 0.00° mean joint-angle error on 1 sequence of 1 performer of built-in motion. No other" in said
    assert "Its mean joint position error is 0 mm." in said


def test_inputs_and_several_takes_are_told_apart(tmp_path: Path) -> None:
    plan = Plan(behaviours=("boxing",), methods={"ik": 1.0}, duration_s=2.0, takes=2, inputs=("pos+ori", "pos"))
    said = text_of(write_run_page(planted_run(tmp_path / "run", plan), rendered=False))
    assert "ik (pos+ori)" in said
    assert "ik (pos)" in said
    assert "the clip with the largest error of 2" in said
    assert " ± " in said


def test_a_varied_number_gives_a_curve_and_its_table(tmp_path: Path) -> None:
    """The table has all values; all other sections show the last one."""
    varied = {"components.echo.share": [0.0, 0.02, 0.1]}
    plan = Plan(behaviours=("boxing",), methods={"ik": 1.0, "mean_pose": 9.0}, duration_s=2.0, vary=varied)
    out = planted_run(tmp_path / "run", plan)
    page = write_run_page(out, rendered=False)
    said = text_of(page)
    curve = (out / "plots" / "varied_components_echo_share_boxing.svg").read_text()
    assert "components.echo.share" in curve
    assert "boxing: error against components.echo.share" in said
    rows = json.loads((out / "summary.json").read_text())["behaviours"]
    assert len(rows) == 6
    for row in rows:
        assert f" {row['metrics']['joint_angle_mean_deg']['mean']:.2f} " in said
    last = next(r["metrics"]["joint_angle_mean_deg"]["mean"] for r in rows[4:] if r["method"] == "ik")
    assert f"ik has the lowest mean joint-angle error, {last:.2f}° on 1 sequence" in said
    assert "of 1 performer of built-in motion, with components.echo.share=0.1, but cannot be called better than" in said
    assert {trace.key for trace in read_run(out).traces} == {
        row["key"] for row in read_run(out).full_summary["cells"][-2:]
    }


def test_charts_show_no_more_lines_than_look_different(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("harness.report.run.data.STYLES", 3)
    out = planted_run(
        tmp_path / "run", Plan(behaviours=("walking",), methods={"poor": 20.0, **METHODS}, duration_s=2.0)
    )
    page = write_run_page(out, rendered=False).read_text()
    for name in ("error_walking", "error_cdf"):
        drawn = (out / "plots" / f"{name}.svg").read_text()
        shown = re.findall(r">([a-z_+]+)( \([a-z ]+\))?<", drawn)
        assert [(method, role) for method, role in shown if method in ("poor", *METHODS)] == [
            ("best_match+ik", " (lowest mean)"),
            ("ik", " (control)"),
            ("best_match", ""),
        ]
    assert page.count("Only the 3 of 5 methods with the lowest errors are shown.") == 2


def test_the_ranking_shows_what_has_room(tmp_path: Path) -> None:
    methods = {f"m{n}": 1.0 + n for n in range(16)}
    plan = Plan(behaviours=("walking",), methods=methods, duration_s=2.0)
    page = write_run_page(planted_run(tmp_path / "run", plan), rendered=False).read_text()
    assert "The 14 of 16 methods with the lowest means." in page


def test_varied_words_give_a_table_and_no_curve(tmp_path: Path) -> None:
    varied = {"noise": ["clean", "default"]}
    out = planted_run(tmp_path / "run", Plan(behaviours=("boxing",), methods={"ik": 1.0}, duration_s=2.0, vary=varied))
    said = text_of(write_run_page(out, rendered=False))
    assert "method noise=clean noise=default ik n 1 " in said
    assert not list((out / "plots").glob("varied*"))


def test_known_and_new_performers_are_ranked_apart(tmp_path: Path) -> None:
    plan = Plan(behaviours=("walking",), methods={"ik": 1.0, "mean_pose": 9.0}, duration_s=2.0, takes=2)
    said = text_of(write_run_page(planted_run(tmp_path / "run", replace(plan, known=1)), rendered=False))
    for kind in ("known", "new"):
        assert f"ik ({kind} performer) has the lowest mean joint-angle error, " in said
        assert f"on 1 sequence of 1 performer of built-in motion by {kind} performers" in said


def test_a_folder_that_is_no_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadFile, match="no results of the harness; expected a run or a sweep"):
        write_run_page(tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_missing_extra_costs_the_pictures_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(render_process, "find_spec", lambda name: None)
    plan = Plan(behaviours=("walking",), methods={"ik": 2.0}, duration_s=2.0)
    page = write_run_page(planted_run(tmp_path / "run", plan))
    said = text_of(page)
    assert "needs pyvista; install it with: pip install &#x27;tracker-harness[viz]&#x27;" in said
    assert 'id="player"' in page.read_text(encoding="utf-8")
    assert "Error distribution" in said


def test_a_renderer_that_crashes_leaves_the_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_DIRS", str(tmp_path / "none"))
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "vtkEGLRenderWindow")
    monkeypatch.delenv("DISPLAY", raising=False)
    out = planted_run(tmp_path / "run", Plan(behaviours=("walking",), methods={"ik": 2.0}, duration_s=2.0))
    said = text_of(write_run_page(out))
    assert "Rendered pictures of the worst two seconds: the renderer" in said
    assert "In 3-D" in said
    assert not list((out / "plots").glob("*.png"))


def test_rendered_strips_show_two_bodies(tmp_path: Path, renders: None) -> None:
    from matplotlib.image import imread

    out = planted_run(tmp_path / "run", Plan(behaviours=("walking",), methods={"ik": 6.0}, duration_s=4.0))
    page = write_run_page(out)
    strips = list((out / "plots").glob("worst_*.png"))
    assert 1 <= len(strips) <= len(WORST_METRICS)
    text = page.read_text(encoding="utf-8")
    assert all(picture_uri(strip) in text for strip in strips)
    assert "ik at its worst instant: walking_p1_01, " in text
    with Image.open(out / "plots" / "worst_instant.png") as still:
        assert still.size == (640, 600)
    for strip in strips:
        red, _, blue = np.moveaxis(imread(strip)[..., :3], -1, 0)
        assert np.mean(red - blue > 0.3) > 0.003, "no orange estimate"
        assert np.mean(blue - red > 0.1) > 0.003, "no blue truth"


@pytest.mark.parametrize("silent", [("ik",), ("ik", "mean_pose")])
def test_methods_that_never_answer_are_not_measured(tmp_path: Path, silent: tuple[str, ...]) -> None:
    plan = Plan(behaviours=("walking",), methods={"ik": 2.0, "mean_pose": 9.0}, duration_s=2.0, silent=silent)
    said = text_of(write_run_page(planted_run(tmp_path / "run", plan), rendered=False))
    if len(silent) == 2:
        assert "Nothing was measured: 2 of 2 cells finished." in said
        assert "0 of 80 frames matched (0.0 %)" in said
    else:
        assert re.search(r"mean_pose: \d+\.\d\d° .*\. No other method was measured", said)
        assert "40 of 80 frames matched (50.0 %)" in said
    assert "nan" not in said.lower().split()


def test_importing_the_report_draws_in_no_heavy_library_and_no_global_plot_state(tmp_path: Path) -> None:
    planted_run(tmp_path / "run", Plan(behaviours=("walking",), methods={"ik": 2.0}, duration_s=2.0))
    code = (
        "import sys; from pathlib import Path; from harness.report.run.page import write_run_page;"
        "assert not {'pyvista', 'vtk', 'matplotlib'} & set(sys.modules);"
        "import matplotlib; before = matplotlib.rcParams.copy(); write_run_page(Path(sys.argv[1]), rendered=False);"
        "assert matplotlib.rcParams.copy() == before; assert 'matplotlib.pyplot' not in sys.modules;"
        "assert 'pyvista' not in sys.modules"
    )
    command = [sys.executable, "-c", code, str(tmp_path / "run")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
