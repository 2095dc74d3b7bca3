"""What a scenario expects: orders of methods, and recovery from disturbances."""

import re

from harness.report.kit.page import Page, Section
from harness.report.kit.page_html import page_table, render_html
from harness.report.kit.page_text import join_blocks, table_lines
from harness.report.run.expectations import expected_orders, recovery_table

ORDER = {
    "source": "a paper",
    "method": "",
    "names": ["new", "old", "ik"],
    "behaviour": "table_tennis",
    "inputs": "pos+ori",
    "performer": "known",
    "varied": {"noise": "clean"},
    "clips": 2,
    "clips_of_any": 2,
    "means_deg": [0.8349, 0.97, 2.14],
    "holds": True,
    "why": [],
}
WHY = ["old > ik: because"]
ORDERS = [
    ORDER,
    ORDER
    | {"performer": "new", "clips": 1, "means_deg": [2.4, 2.4, 1.9], "holds": False, "why": ["old > ik: because"]},
    ORDER | {"inputs": "pos", "means_deg": [0.8, 2.0, 1.9], "holds": False, "why": ["old > ik: because"]},
    ORDER | {"clips": 0, "clips_of_any": 0, "means_deg": None, "holds": None, "why": ["old not measured"]},
    ORDER | {"names": ["pos+ori", "pos"], "method": "new", "inputs": "", "varied": {}, "means_deg": [1.0, 2.0]},
]


def test_each_order_is_a_table_with_a_row_for_each_setting() -> None:
    lines = join_blocks(expected_orders({"expected_orders": ORDERS}), 160)
    cells = [re.split(r"\s{2,}", line.strip()) for line in lines]
    assert ["Expected: new < old < ik (a paper)."] in cells
    assert ["setting", "new", "old", "ik", "order"] in cells
    assert ["table tennis, pos+ori, known performers, noise=clean n 2", "0.83", "0.97", "2.14", "holds"] in cells
    same = ["table tennis, pos+ori, new performers, noise=clean n 1 of 2", "2.40", "2.40", "1.90", "does not hold"]
    assert same in cells
    nothing = ["not measured"] * 3
    assert [
        "table tennis, pos+ori, known performers, noise=clean n 0",
        *nothing,
        "not judged: old not measured",
    ] in cells
    assert cells.count(["Where old > ik: because"]) == 1
    assert ["Expected: new with pos+ori < pos (a paper)."] in cells
    assert cells[-1] == ["table tennis, known performers n 2", "1.00", "2.00", "holds"]


def test_the_page_says_the_same_and_keeps_text_text() -> None:
    hostile = ORDER | {"source": "<b>", "holds": None, "means_deg": None, "why": ["a & b"]}
    blocks = expected_orders({"expected_orders": [*ORDERS, hostile]})
    page = render_html(Page("report", "", "", {}, [Section("Orders", "orders", blocks)]))
    assert page.count("<table") == 3
    assert page.count(">does not hold<") == 2
    assert page.count("<li>Where old &gt; ik: because</li>") == 1
    assert "(&lt;b&gt;)" in page
    assert ">not judged: a &amp; b<" in page


def test_a_run_without_expectations_says_nothing() -> None:
    assert expected_orders({"expected_orders": []}) == expected_orders({}) == []
    assert recovery_table({}).rows == recovery_table({"recovery": []}).rows == []


TAKE = {
    "method": "ik",
    "inputs": "pos+ori",
    "split": "none",
    "clip": "a",
    "evaluated_frames": 40,
    "disturbed_deg": 3.0,
    "undisturbed_deg": 2.0,
    "ratio": 1.5,
    "during": 4.0,
    "back_after_s": 0.5,
    "status_right": 0.995,
}


def test_ratios_that_are_too_large_or_unknown_are_marked() -> None:
    rows = [
        TAKE | {"disturbance": "one_lost"},
        TAKE | {"disturbance": "all_lost", "disturbed_deg": 3.1, "ratio": 1.55},
        TAKE | {"disturbance": "one_off", "disturbed_deg": None, "ratio": None, "back_after_s": None},
    ]
    rows.append(TAKE | {"disturbance": "start_off", "evaluated_frames": 0, "ratio": None, "status_right": None})
    table = recovery_table({"recovery": rows})
    *title, head, line = table_lines(table, 200)
    assert " ".join(title).startswith("recovery: ")
    for word in ("method", "split", "clips", "undisturbed [deg]", "one_lost", "all_lost", "one_off", "status right"):
        assert word in head
    assert "4.00, then 1.50 (1.50)  4.00, then 1.55 (1.55) FAIL  4.00, then nan (nan) FAIL  not measured" in line
    assert line.endswith("99.50 %")
    page = page_table(table)
    assert "1.55 (1.55) FAIL" in page
    assert '<th scope="col">all_lost</th>' in page
