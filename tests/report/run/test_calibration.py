"""Tests of the calibration tables."""

from typing import Any

from harness.compare import BY_NAME, Sampling
from harness.report.kit.page_html import page_table
from harness.report.kit.page_text import table_lines
from harness.report.run.calibration import calibration_cost, calibration_errors, calibration_tables

FOUND = {"mount_mm": 20.0, "mount_deg": 5.0, "length_mm": 0.0, "room_heading_deg": 3.0, "room_origin_mm": 30.0}


def cell(kind: str, clip: str, errors: dict[str, float] | None = None, method: str = "ik") -> dict[str, Any]:
    varied = {"calibration": kind}
    return {"calibration": kind, "varied": varied, "clip": clip, "method": method, "calibration_errors": errors or {}}


CELLS = [
    *(cell("exact", clip) for clip in ("a", "b")),
    *(cell("tpose", "a", FOUND, method) for method in ("ik", "dynamic_map")),
    cell("tpose", "b", FOUND | {"mount_mm": 30.0}),
    *(cell("poses", clip, FOUND | {"length_mm": 6.0}) for clip in ("a", "b")),
]


def test_each_session_counts_once_whatever_methods_were_shown_it() -> None:
    head, exact, tpose, poses = table_lines(calibration_errors(CELLS))[-4:]
    assert head.split("  ")[0] == "calibration"
    assert exact.split() == ["exact", "2", *["known"] * 5]
    assert "25.0 (30.0)" in tpose  # not the mean over cells
    assert "known" in tpose
    assert "6.0 (6.0)" in poses
    assert "known" not in poses


def test_what_else_is_varied_stands_beside_it() -> None:
    cells = [{**one, "varied": {**one["varied"], "noise": noise}} for noise in ("clean", "default") for one in CELLS]
    lines = table_lines(calibration_errors(cells), 200)
    assert len(lines) == len(table_lines(calibration_errors(CELLS), 200)) + 3
    assert "calibration=poses noise=default" in "\n".join(lines)


def test_the_page_has_the_same_table() -> None:
    page = page_table(calibration_errors(CELLS))
    assert "<td>25.0 (30.0)</td>" in page
    assert '<th scope="row">poses</th>' in page


def test_a_run_whose_calibration_is_exact_says_nothing() -> None:
    assert list(calibration_errors(CELLS[:2]).rows) == []
    assert [list(table.rows) for table in calibration_tables({})] == [[], []]


def judged(kind: str, clip: str, error: float | None) -> dict[str, Any]:
    same = {"behaviour": "walking", "performer": "", "inputs": "pos+ori", "joint_angle_mean_deg": error}
    return cell(kind, clip) | same | {"mpjpe_pa_mm": error}


def test_what_calibrating_costs_is_paired_by_unit() -> None:
    clips = "abcdef"
    exact = [judged("exact", clip, float(n)) for n, clip in enumerate(clips)]
    cost = [judged("poses", clip, n + 0.5) for n, clip in enumerate(clips)]
    few = [judged("tpose", clip, n + 1.0 if n else None) for n, clip in enumerate(clips)]
    table = calibration_cost([*exact, *cost, *few], BY_NAME)
    angle, place = table.rows
    assert table.head == ["behaviour", "method", "error", "exact", "poses", "tpose"]
    assert angle[2:] == ["joint angle [deg]", "2.50", "+0.5", "+1 (too few units: 5, of at least 6)"]
    assert place[2:4] == ["mpjpe_pa [mm]", "2.5"]
    of_two = Sampling({clip: "Anna" if clip < "d" else "Bert" for clip in clips})
    few_performers = calibration_cost([*exact, *cost], of_two)
    assert few_performers.rows[0][-1] == "+0.5 (too few units: 2, of at least 6)"
    assert "<td>+0.5</td>" in page_table(calibration_cost([*exact, *cost], BY_NAME))


def test_no_cost_is_told_without_something_to_hold_it_against() -> None:
    for cells in ([judged("poses", "a", 1.0)], [judged("exact", "a", 1.0)], []):
        assert list(calibration_cost(cells, BY_NAME).rows) == []


def test_what_an_equation_does_not_give_is_none() -> None:
    """Kim's maps have no mounts and no common origin; the bones are the truth."""
    table = calibration_errors([*CELLS, cell("kim2012", "a", {"room_heading_deg": 2.0})])
    (row,) = [row for row in table.rows if row[0] == "kim2012"]
    assert row == ["kim2012", "", "1", "none", "none", "known", "2.00 (2.00)", "none"]
