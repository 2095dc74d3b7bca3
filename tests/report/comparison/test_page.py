"""Text and page of a comparison: every verdict is shown, nothing is left out, and hostile names break nothing."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

from harness.compare import Comparison
from harness.core.number_format import format_change_percent
from harness.errors import Outcome
from harness.report.comparison.charts import BETTER_COLOUR, WORSE_COLOUR, interval_charts, slope_chart
from harness.report.comparison.charts import _draw_intervals as draw_intervals
from harness.report.comparison.charts import _draw_line as draw_slopes
from harness.report.comparison.page import comparison_page, comparison_text, write_comparison_page
from harness.report.comparison.wording import (
    MARKS,
    MEANINGS,
    OUTCOME_TITLES,
    comparison_sentence,
    count_directions,
    count_verdicts,
    describe_parts,
    format_margin,
    format_mean,
    line_interval,
)
from harness.report.kit.chart import draw_chart
from harness.report.kit.page_html import render_html
from harness.report.kit.style import Chart
from tests.report.comparison.compared import CIRCUMSTANCES, compared, every_verdict, nothing_compared, one_line
from tests.report.drawing import texts_apart
from tests.report.reading import read, text_of

HOSTILE = "<script>alert(1)</script>&\"'$x^2$\n <!-- -->"


@pytest.fixture(scope="module")
def comparison() -> Comparison:
    return every_verdict()


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory, comparison: Comparison) -> Path:
    return write_comparison_page(comparison, tmp_path_factory.mktemp("comparison") / "deep" / "page.html")


def gated(comparison: Comparison) -> list[Any]:
    return [line for line in comparison.differences if line.gated]


def test_the_first_line_is_the_verdict(comparison: Comparison) -> None:
    lines = comparison_text(comparison).splitlines()
    (worse,) = (found for found in gated(comparison) if found.verdict == "worse")
    share = format_change_percent(100.0 * worse.difference / worse.mean_a)
    assert lines[0] == f"B is worse than A in 1 of 4 gated lines on 24 takes: local_pca mpjpe_mm {share}."
    assert lines[2:4] == ["A: baseline gate", "B: results/gate"]


def test_one_sentence_says_what_came_of_it(tmp_path: Path) -> None:
    incomplete = nothing_compared(outcome=Outcome.INCOMPLETE, why="planned cells are missing: A: ik")
    for shown, title, said in (
        (compared({"ik": 0.0, "dynamic_map": -0.06}), "Pass", "B is no worse than A in 2 gated lines on 24 takes"),
        (every_verdict(3), "Cannot tell", "It cannot be decided whether B is worse than A: "),
        (replace(every_verdict(3), coverage=("A: ik",)), "Not comparable", "It cannot be decided"),
        (incomplete, "Incomplete", "missing: A: ik."),
        (nothing_compared(why="no cell of A has a partner in B"), "Not comparable", "no cell of A has a partner in B."),
    ):
        assert said in comparison_sentence(shown)
        found = text_of(write_comparison_page(shown, tmp_path / "page.html"))
        assert f"{title} {comparison_sentence(shown)}" in found
        assert "nan" not in found.lower().split()
    assert {Outcome.PASS, Outcome.REGRESSED, Outcome.NOT_COMPARABLE, Outcome.INCOMPLETE} == set(OUTCOME_TITLES)


def test_a_margin_is_never_zero() -> None:
    line = one_line(0.05)
    assert format_margin(replace(line, margin=0.036, low=-8.0, high=14.0)) == "0.04"
    assert format_margin(replace(line, margin=0.036, low=1.31, high=1.33)) == "0.036"
    assert format_margin(replace(line, margin=1200.0, low=-8000.0, high=9000.0)) == "1,200"


@pytest.mark.parametrize(("units", "told"), [(5, "has 6 units, which a verdict needs"), (6, "shows a difference")])
def test_parts_with_too_few_units_are_not_said_to_be_alike(units: int, told: str) -> None:
    found = every_verdict(units)
    torn = next(line for line in found.differences if line.gated and line.method == "torn")
    parts = replace(found, differences=(replace(torn, part="golf"),))
    assert describe_parts(parts, torn).startswith(f"no behaviour alone {told}, the largest is ")


def test_every_line_has_its_figures_in_both(page: Path, comparison: Comparison) -> None:
    printed, shown = comparison_text(comparison), text_of(page)
    assert {found.verdict for found in gated(comparison)} == set(MARKS)
    for found in comparison.differences:
        number = line_interval(found)
        assert all(word in printed for word in (found.method, found.metric, str(number)))
        assert all(word in shown for word in (found.method, found.metric, number.number, number.ends))
        assert re.search(rf"{found.method} \({found.metric} .*\) +\{MARKS[found.verdict]} {found.verdict} ", printed)
    assert printed.index("✗ worse") < printed.index("? cannot tell") < printed.index("✓ better")
    assert printed.index("= same") < printed.index("not gated") < printed.rindex("jitter_m_s3")


def test_the_page_opens_on_the_verdict_then_the_slopes(page: Path, comparison: Comparison) -> None:
    raw = page.read_text(encoding="utf-8")
    places = [raw.index(part) for part in ('class="big regressed"', 'class="tally"', "<nav", 'id="slopes"')]
    assert places == sorted(places)
    places = [raw.index(f'id="{name}"') for name in ("slopes", "intervals", "figures", "differs", "verdicts")]
    assert places == sorted(places)
    counts = re.findall(r'<li><b>(\d+)</b><span class="verdict (\w+)">', raw)
    assert [(int(count), name) for count, name in counts] == [
        (count, kind.replace(" ", "_")) for kind, count in count_verdicts(gated(comparison)).items()
    ]
    assert all(meaning in text_of(page) for meaning in MEANINGS.values())


def test_every_picture_is_told_in_words(page: Path, comparison: Comparison) -> None:
    alts = [str(attributes["alt"]) for tag, attributes in read(page).found if tag == "img"]
    for found in gated(comparison):
        (alt,) = (alt for alt in alts if alt.startswith(f"{found.method} {found.metric}:"))
        assert f"difference {line_interval(found)}, " in alt
        assert f": {found.verdict}. 24 clips" in alt


def test_a_slope_goes_from_a_to_b_beside_the_margin() -> None:
    one, figure = one_line(0.05), Figure(figsize=(3.3, 2.5))
    draw_slopes(figure, one)
    left, right = figure.axes
    (lines,) = left.collections
    ends = [segment[:, 1] for segment in lines.get_segments()]  # type: ignore[attr-defined]  # a LineCollection
    assert [(a, b) for a, b in ends] == list(zip(one.a, one.b, strict=True))
    assert right.get_ylim()[0] <= -one.margin < one.margin <= right.get_ylim()[1]


def test_a_slope_is_coloured_by_what_it_means() -> None:
    """If all clips rise, errors are worse and frames per second are better."""
    rising = one_line(0.3, 8)
    error, speed = slope_chart(rising, 1).svg, slope_chart(replace(rising, metric="fps", unit="frames/s"), 1).svg
    assert count_directions(rising) == (8, 0, 0)
    assert [colour in error for colour in (WORSE_COLOUR, BETTER_COLOUR)] == [True, False]
    assert [colour in speed for colour in (WORSE_COLOUR, BETTER_COLOUR)] == [False, True]


@pytest.mark.parametrize("clips", [1, 6, 60])
def test_words_of_a_picture_do_not_meet_and_stay_on_it(clips: int) -> None:
    made: list[Figure] = []

    def draw(figure: Figure) -> None:
        draw_slopes(figure, one_line(0.3, clips))
        made.append(figure)

    draw_chart("slopes", "", "", "", draw, 2.5, width_in=3.3, layout=None)
    texts_apart(made[0])


def test_names_of_an_interval_chart_do_not_meet() -> None:
    names = ["ik", "dynamic_map[neigh…\nlong,\npos, new", "x\ny"]
    lines = [one_line(change, 8) for change in (0.01, 3.0, -0.2)]
    made: list[Figure] = []

    def draw(figure: Figure) -> None:
        draw_intervals(figure, lines, names)
        made.append(figure)

    draw_chart("intervals", "", "", "", draw, 2.2, width_in=4.2)
    texts_apart(made[0])


@pytest.mark.parametrize("clips", [1, 5])
def test_too_few_clips_are_shown_and_not_told(clips: int, tmp_path: Path) -> None:
    shown = compared({"ik": 0.05}, clips)
    said = text_of(write_comparison_page(shown, tmp_path / "page.html"))
    assert f"too few units: {clips}, of at least 6" in said
    assert f"cannot tell, too few units: {clips}, of at least 6: ik mpjpe_mm" in comparison_text(shown)
    assert "nan" not in said.lower().split()


def test_sixty_clips_are_drawn_and_listed(tmp_path: Path) -> None:
    shown = compared({"ik": 0.05}, 60)
    said = text_of(write_comparison_page(shown, tmp_path / "page.html"))
    assert "60 clips: " in said
    assert all(said.count(clip) for clip in shown.differences[0].clips)
    assert len(slope_chart(shown.differences[0], 1).svg) < 80_000


def test_what_differs_is_named_and_long_lists_are_counted(tmp_path: Path) -> None:
    cells = tuple(f"ik on walking_{n}" for n in range(500))
    shown = nothing_compared(only_a=cells, only_b=cells[:2], inputs_that_differ=("tracker.rate_hz: 40 against 60",))
    printed, said = comparison_text(shown), text_of(write_comparison_page(shown, tmp_path / "page.html"))
    for found in (printed, said):
        assert "tracker.rate_hz: 40 against 60" in found
        assert "ik on walking_0, ik on walking_1" in found
        assert all(name in found for name in CIRCUMSTANCES)
    assert "cells only in A: 500 (ik on walking_0, ik on walking_1, ik on walking_2 and 497 more)" in printed
    assert "and 300 more" in said
    assert max(map(len, printed.splitlines())) < 200


def test_long_values_are_cut_to_where_they_differ() -> None:
    a, b = (f"LocalPca(name='local_pca', {'index=None, ' * 20}neighbours={n}, {'loss=None, ' * 20})" for n in (300, 30))
    shown = nothing_compared(circumstances=(("constants.local_pca", a, b), ("dirty", "no", "yes")))
    printed = comparison_text(shown)
    (row,) = (row for row in printed.splitlines() if "constants" in row)
    assert all(text in row for text in ("neighbours=300,", "neighbours=30,"))
    assert len(row) < 180
    assert "differs: dirty: no -> yes" in printed


def test_equal_sides_are_the_same_and_nothing_differs(tmp_path: Path) -> None:
    shown = replace(compared({"ik": 0.0}, 6), circumstances=())
    assert shown.outcome is Outcome.PASS
    assert "6 clips: 6 unchanged." in slope_chart(shown.differences[0], 1).alt
    said = text_of(write_comparison_page(shown, tmp_path / "page.html"))
    assert "Nothing: inputs, circumstances and cells are the same." in said


def test_groups_are_told_apart_where_there_are_several(tmp_path: Path) -> None:
    one = compared({"ik": 0.05}, 6)
    others = tuple(replace(line, group="pos, subject, new") for line in gated(one))
    both = replace(one, differences=(*gated(one), *others))
    assert comparison_text(both).count("pos, subject, new") == 1
    assert text_of(write_comparison_page(both, tmp_path / "page.html")).count("pos, subject, new") == 3
    assert "pos, subject, new" not in comparison_text(one)


def test_lines_stand_worst_first_and_of_many_slopes_the_rest_is_folded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("harness.report.comparison.page.slope_chart", lambda line, n: Chart("", "", "", "", "<svg/>"))
    monkeypatch.setattr("harness.report.comparison.page.interval_charts", lambda *sides: [])
    raw = render_html(comparison_page(compared({**{f"m{n}": 0.0 for n in range(29)}, "bad": 0.4}, 6)))
    assert re.findall(r'<th scope="row">(\w+)<', raw)[:2] == ["bad", "m0"]
    assert raw.index('alt=""') < raw.index("<summary>6 more lines</summary>")
    assert raw.count('class="panel"') == 30


def test_hostile_names_stay_text(tmp_path: Path) -> None:
    one = one_line(0.3, 6)
    lines = [
        replace(one, method=HOSTILE, group=group, unit=HOSTILE, why=HOSTILE, clips=(HOSTILE,) * 6)
        for group in (one.group, HOSTILE)
    ]
    lists = dict.fromkeys(("only_a", "only_b", "inputs_that_differ", "allowed", "coverage", "failed"), (HOSTILE,))
    words = {"a": HOSTILE, "b": HOSTILE, "why": HOSTILE, "circumstances": ((HOSTILE,) * 3,)}
    shown = nothing_compared(differences=tuple(lines), outcome=Outcome.REGRESSED, **words, **lists)
    page = write_comparison_page(shown, tmp_path / "page.html")
    raw = page.read_text(encoding="utf-8")
    assert "<script>alert" not in raw
    assert read(page).text.count(HOSTILE) > 15
    assert not re.search(r"(?:src|href)=\"(?!data:|#)", raw)
    assert HOSTILE.splitlines()[0] in comparison_text(shown)


def test_a_mean_of_zero_has_no_share(tmp_path: Path) -> None:
    zero = compared({"ik": 0.3}, 6)
    zero = replace(zero, differences=tuple(replace(line, a=(0.0,) * 6, mean_a=0.0) for line in gated(zero)))
    said = text_of(write_comparison_page(zero, tmp_path / "page.html"))
    assert "nan" not in said.lower()
    assert "nan" not in comparison_text(zero).lower()


def test_the_same_comparison_gives_the_same_bytes() -> None:
    one = compared({"local_pca": 0.05}, 8)
    assert slope_chart(one.differences[0], 1) == slope_chart(one.differences[0], 1)
    first, again = (draw() for _ in range(2) for draw in interval_charts([one], True))
    assert first == again


def test_what_is_far_below_the_margin_has_no_digits_of_its_own() -> None:
    line = replace(
        one_line(0.0), mean_a=620.9863, mean_b=620.9832, difference=-0.0031, low=-0.023, high=0.004, margin=12.4
    )
    assert str(line_interval(line)) == "0"
    assert (format_mean(line, line.mean_a), format_margin(line)) == ("621", "12")
    wider = replace(line, low=-0.2)
    assert line_interval(wider).ends.startswith("−0.2")
    assert format_mean(wider, wider.mean_a) == "620.99"
