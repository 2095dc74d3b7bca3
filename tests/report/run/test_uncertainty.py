"""The page of a run whose methods state standard deviations, or answer late."""

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from harness.report.kit.page import DataTable
from harness.report.kit.page_html import page_table
from harness.report.kit.ranking import LAG_NOTE
from harness.report.run.data import read_run
from harness.report.run.headline import run_verdict
from harness.report.run.joint_errors import _draw_bands, error_against_sigma
from harness.report.run.page import write_run_page
from harness.report.run.tables import results_tables, sigma_table
from harness.results import read_summary
from tests.planted import Plan, planted_run

LATE = "smooth (lag 2)"


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two methods that state standard deviations, of which one is late, as is the most accurate one."""
    plan = Plan(
        methods={"ik": 2.0, "gauss": 1.5, "smooth": 0.5, "late": 1.0},
        sigma_deg={"gauss": 2.5, "late": 1.0},
        lags={"smooth": 2, "late": 2},
        takes=10,
        duration_s=2.0,
        behaviours=("walking",),
    )
    out = planted_run(tmp_path_factory.mktemp("sigma") / "run", plan)
    write_run_page(out, rendered=False)
    return out


def test_the_late_methods_are_named_and_ranked_apart(run_folder: Path) -> None:
    run = read_run(run_folder)
    assert set(run.series) == {"ik", "gauss", LATE, "late (lag 2)"}
    verdict, lowest = run_verdict(run)
    assert lowest == "gauss"
    assert verdict.startswith("gauss is best: ")
    assert f"{LATE} is best: " in verdict
    assert LAG_NOTE in verdict
    assert verdict.count("error is") == verdict.count("also the lowest") == 2
    assert "has the lowest joint position error" not in verdict


def test_each_group_has_its_bold_cell(run_folder: Path) -> None:
    table = results_tables(read_run(run_folder))[0]
    assert isinstance(table, DataTable)
    first = page_table(table)
    bold = re.findall(r'<th scope="row">([^<]*)</th><td><strong>', first)
    assert sorted(bold) == ["gauss", LATE]
    assert LAG_NOTE in first


def test_a_run_of_causal_methods_has_none_of_this(tmp_path: Path) -> None:
    out = planted_run(tmp_path / "run", Plan(methods={"ik": 2.0, "gauss": 1.5}, behaviours=("walking",)))
    page = write_run_page(out, rendered=False).read_text(encoding="utf-8")
    assert LAG_NOTE not in page
    assert "Stated uncertainty" not in page
    assert "leaves the last frames" not in page
    assert "data:band" not in (out / "plots" / "error_walking.svg").read_text()
    assert not list((out / "plots").glob("sigma*"))
    assert list(sigma_table(read_run(out)).rows) == []


def test_the_coverage_says_why_the_last_frames_have_no_estimate(run_folder: Path) -> None:
    page = (run_folder / "report.html").read_text(encoding="utf-8")
    assert "A method with a lag leaves the last frames of a take unanswered." in page


def test_the_table_has_the_scores_of_the_summary(run_folder: Path) -> None:
    table = re.sub(r"<[^>]*>", "|", page_table(sigma_table(read_run(run_folder))))
    texts = [text.strip() for text in table.split("|") if text.strip()]
    pooled = {row["method"]: row["sigma_scores"] for row in read_summary(run_folder)["behaviours"]}
    for method in ("gauss", "late"):
        row = texts[texts.index(f"{method} (lag 2)" if method == "late" else method) :]
        assert row[1] == "walking"
        assert row[2] == f"{100.0 * pooled[method]['sigma_coverage_1']:.1f}"
        assert row[3] == f"{100.0 * pooled[method]['sigma_coverage_95']:.1f}"
        assert row[4] == f"{100.0 * pooled[method]['sigma_lowest_coverage_1']:.1f}"
        assert row[6] == f"{pooled[method]['sigma_width_deg']:.2f}"
        assert row[7] == f"{pooled[method]['sigma_log_score']:.2f}"
    assert "ik" not in texts


def test_errors_and_deviations_of_a_hinge_lie_in_one_row(run_folder: Path) -> None:
    run = read_run(run_folder)
    traces = [trace for trace in run.traces if trace.series == "gauss"]
    assert traces
    for trace in traces:
        cell = run.cell(trace.key)
        shares = cell.scores.per_joint["sigma_coverage_1"].values()
        covered = np.mean(trace.hinge_deg <= trace.sigma_deg[trace.scored], axis=0)
        np.testing.assert_allclose(covered, list(shares), atol=1e-6)


def test_charts_draw_the_deviations(run_folder: Path) -> None:
    page = (run_folder / "report.html").read_text(encoding="utf-8")
    assert "Shaded: up to the mean standard deviation" in page
    over_time = (run_folder / "plots" / "error_walking.svg").read_text()
    assert over_time.count('id="data:band=') == 1, "only the leader and the control have a band"
    assert (run_folder / "plots" / "sigma.svg").is_file()
    run = read_run(run_folder)
    svg = error_against_sigma(run, "gauss").svg
    error_deg = np.concatenate([t.hinge_deg for t in run.traces if t.series == "gauss"])
    sigma_deg = np.concatenate([t.sigma_deg[t.scored] for t in run.traces if t.series == "gauss"])
    for share in np.mean(error_deg <= sigma_deg, axis=0):
        assert f">{100.0 * share:.0f} %<" in svg


def test_bands_reach_to_one_sigma_and_to_the_end_of_the_95_percent_region() -> None:
    axes = Figure().add_subplot()
    _draw_bands(axes, np.array([2.0, 4.0]))
    widths = sorted(bar.get_width() for bar in axes.patches if isinstance(bar, Rectangle))
    np.testing.assert_allclose(widths, [2.0, 4.0, 2.6589 * 2.0, 2.6589 * 4.0])
