"""Tests of the text and tables of expected orders."""

from harness.report.run.expected_orders import section, text

ROW = {
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
ROWS = [
    ROW,
    ROW | {"performer": "new", "clips": 1, "means_deg": [2.4, 2.4, 1.9], "holds": False, "why": ["old > ik: because"]},
    ROW | {"inputs": "pos", "means_deg": [0.8, 2.0, 1.9], "holds": False, "why": ["old > ik: because"]},
    ROW | {"clips": 0, "clips_of_any": 0, "means_deg": None, "holds": None, "why": ["old not measured"]},
    ROW | {"names": ["pos+ori", "pos"], "method": "new", "inputs": "", "varied": {}, "means_deg": [1.0, 2.0]},
]


def test_each_order_is_stated_once_with_a_line_for_each_setting() -> None:
    assert text({"expected_orders": ROWS})[1:] == [
        "",
        "new < old < ik (a paper)",
        "  new 0.83 < old 0.97 < ik 2.14: holds (table tennis, pos+ori, known performers, noise=clean, 2 clips)",
        "  new 2.40 = old 2.40 > ik 1.90: does not hold (table tennis, pos+ori, new performers, noise=clean, "
        "1 of 2 clips)",
        "  new 0.80 < old 2.00 > ik 1.90: does not hold (table tennis, pos, known performers, noise=clean, 2 clips)",
        "  not judged: old not measured (table tennis, pos+ori, known performers, noise=clean)",
        "  where old > ik: because",
        "",
        "new with pos+ori < pos (a paper)",
        "  pos+ori 1.00 < pos 2.00: holds (table tennis, known performers, 2 clips)",
        "",
    ]


def test_the_page_says_the_same_and_keeps_text_text() -> None:
    page = section(
        {"expected_orders": [*ROWS, ROW | {"source": "<b>", "holds": None, "means_deg": None, "why": ["a & b"]}]}
    )
    assert page.count("<table") == 3
    assert page.count("<td>does not hold</td>") == 2
    assert page.count("<li>Where old &gt; ik: because</li>") == 1
    assert "(&lt;b&gt;)" in page
    assert "<td>not judged: a &amp; b</td>" in page


def test_a_run_without_expectations_says_nothing() -> None:
    assert text({"expected_orders": []}) == text({}) == []
    assert section({}) == ""
