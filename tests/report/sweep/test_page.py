"""Page and text of a sweep: their first sentence, their numbers and their size."""

import itertools
import json
import re
import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from harness.cli import main
from harness.compare import Sampling, mean_interval
from harness.errors import BadFile
from harness.report.kit.chart import draw_chart
from harness.report.kit.page_html import page_table, render_html
from harness.report.sweep.charts import (
    MAX_SERIES,
    _dot_chart_height_in,
    _draw,
    curves,
    scenarios_varying,
    select_curves,
    sweep_chart,
)
from harness.report.sweep.data import READ_METRICS, Statistic, VariedKey, collect_cells, read_sweep
from harness.report.sweep.effects import key_effects, key_interactions
from harness.report.sweep.page import scenario_table, sweep_page, sweep_text, write_sweep_page
from harness.report.sweep.wording import (
    best_sentence,
    effect_reason,
    group_failures,
    interaction_sentence,
    sweep_sentence,
)
from harness.results import PRIMARY_METRIC, CellIndex
from harness.results.files import compute_digests
from tests.planted import MeansPlan, planted_sweep
from tests.report.drawing import texts_apart
from tests.report.reading import read, text_of
from tests.report.watching import is_whole_and_quiet

pytestmark = pytest.mark.long
HOSTILE = "<script>alert(1)</script>&\"'$x^2$ <!-- -->"
RATE, NOISE = "tracker.rate_hz", "noise"
VARIED = MeansPlan(vary={RATE: (120.0, 20.0, 60.0), NOISE: ("clean", "default")}, failing=("local_pca",))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep folder with its page."""
    out = planted_sweep(tmp_path_factory.mktemp("sweep") / "out", VARIED)
    with CellIndex(out) as index:
        index.expect([f"to come {n}" for n in range(5)])  # as of a sweep that was made larger, and stopped
        index.write_digest(compute_digests(out))
    write_sweep_page(out)
    return out


def sweep_command(folder: Path) -> str:
    with CellIndex(folder, read_only=True) as index:
        return str(index.facts()["command"])


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw no charts, in tests that look at none."""
    monkeypatch.setattr("harness.report.sweep.page.sweep_chart", lambda *lines: None)


def test_it_opens_on_its_result_and_says_how_far_it_came(folder: Path) -> None:
    sweep = read_sweep(folder)
    said = sweep_sentence(sweep)
    assert re.match(r"tracker\.rate_hz: 120 is best; 20 errs [\d.]+ deg \([\d.]+ to [\d.]+\) more\. noise: ", said)
    assert said.endswith("Compared on 7 performers.")
    raw, text = (folder / "report.html").read_text(encoding="utf-8"), " ".join(sweep_text(sweep).split())
    headline, (rate, noise) = sweep_sentence(sweep, reasons=False), map(effect_reason, key_effects(sweep, ""))
    assert (rate, headline) == ("", said.replace(f" ({noise})", ""))
    assert len(headline) < len(said)
    assert f"<h1>{headline}</h1>" in raw
    assert f"noise: {noise}." in raw
    places = [raw.index(f'id="{name}"') for name in ("varied", "scenarios", "failures", "table")]
    assert places == sorted(places)
    assert text.startswith(f"{said} 168 of 257 cells finished, 84 failed, 5 still to run. dynamic_map is best: ")
    assert re.search(
        r"on 14 clips of 7 performers\. That is [\d.]+ deg \(\d+ %\) less than ik, the next, and lower on \d+ of 7",
        best_sentence(sweep),
    )
    for shown in (" ".join(text_of(folder / "report.html").split()), text):
        assert best_sentence(sweep) in shown
        assert interaction_sentence(key_interactions(sweep, "")[0]) in shown


def test_a_mean_is_of_clips_that_are_means_of_their_cells(folder: Path) -> None:
    """The statistic equals means that are computed by hand."""
    sweep = read_sweep(folder)
    with CellIndex(folder, read_only=True) as index:
        cells = list(index.columns("scenario", "method", "varied", "clip", PRIMARY_METRIC))
    rows = [row for row in cells if row[:2] == ("walking", "ik") and json.loads(row[2])[RATE] == 60]
    means = [np.mean([error for *_, name, error in rows if name == clip]) for clip in sorted({row[3] for row in rows})]
    series, value = sweep.series.index("ik"), next(k for k in sweep.keys if k.name == RATE).labels.index("60")
    found = sweep.statistic(PRIMARY_METRIC, sweep.select(0, series, **{RATE: value}), with_interval=True)
    assert (found.clips, len(rows)) == (7, 14)
    assert found.mean == pytest.approx(np.mean(means))
    assert found.sd == pytest.approx(np.std(means, ddof=1))
    assert (found.low, found.high) == pytest.approx(mean_interval(np.array(means)))


def test_numbers_stand_in_rising_order_and_words_as_they_came(folder: Path) -> None:
    rate, noise = read_sweep(folder).keys
    assert (rate.labels, rate.numbers) == (("20", "60", "120"), (20.0, 60.0, 120.0))
    assert (noise.labels, noise.numbers) == (("clean", "default"), ())


def test_the_effect_of_a_key_is_that_of_complete_blocks_paired_over_units(folder: Path) -> None:
    """The errors equal means that are computed by hand; the method that failed everywhere has no block."""
    sweep = read_sweep(folder)
    rate = next(effect for effect in key_effects(sweep, "") if effect.key.name == RATE)
    with CellIndex(folder, read_only=True) as index:
        cells = list(index.columns("scenario", "clip", "method", "varied", PRIMARY_METRIC))
    cells = [(scenario, clip, json.loads(varied)[RATE], error) for scenario, clip, _, varied, error in cells if error]
    by_hand = []
    for performer in range(1, 8):
        names = [f"{behaviour}_p{performer}_01" for behaviour in ("walking", "boxing")]
        at = [
            [np.mean([e for *_, clip, value, e in cells if clip == name and value == r]) for name in names]
            for r in (20, 60, 120)
        ]
        by_hand.append(np.mean(at, axis=1))
    np.testing.assert_allclose(rate.errors, by_hand)
    assert rate.lowest == 2
    assert rate.contrasts[0].difference.value == pytest.approx(
        np.mean(by_hand, axis=0)[0] - np.mean(by_hand, axis=0)[2]
    )


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize("planted", [0.6, 0.0])
def test_an_interaction_is_found_where_it_is_planted_and_nowhere_else(tmp_path: Path, planted: float) -> None:
    vary = {NOISE: ("clean", "default"), RATE: (20.0, 40.0)}
    plan = MeansPlan(
        behaviours=("walking",), clips=12, methods={"ik": 3.0}, vary=vary, interaction=planted, seeds=(1, 2, 3)
    )
    out = planted_sweep(tmp_path / "out", plan)
    sweep = read_sweep(out)
    (interaction,) = key_interactions(sweep, "")
    assert (interaction.key.name, interaction.by.name) == (NOISE, RATE)
    (contrast,) = interaction.contrasts.values()
    low, high = contrast.difference.low, contrast.difference.high
    assert low <= 3.0 * planted * np.exp(0.02) <= high
    said, page = sweep_sentence(sweep), text_of(write_sweep_page(out))
    assert contrast.is_told is (planted > 0.0)
    assert (f"The effect of {NOISE} depends on {RATE}." in said) is (planted > 0.0)
    assert ("cannot be told" in interaction_sentence(interaction)) is (planted == 0.0)
    assert interaction_sentence(interaction) in page
    assert "default instead of clean" in page


def random_cells(rng: np.random.Generator, effect: float, together: float) -> Any:
    """The cells of a sweep of two by three values on 10 performers, who differ from each other."""
    for clip in range(1, 11):
        own = rng.normal(5.0, 1.0)
        for a, b in itertools.product(range(2), range(3)):
            error = own + effect * a + 0.3 * b + together * (a == 1 and b == 2) + rng.normal(0.0, 0.3)
            yield (
                "s",
                f"walking_p{clip}_01",
                "ik",
                "pos",
                "none",
                "",
                json.dumps({"a": "xy"[a], "b": b}),
                *([error] * len(READ_METRICS)),
            )


def test_few_of_many_sweeps_without_an_effect_claim_one(rng: np.random.Generator) -> None:
    """At most one in twenty by the significance level; the bound is that of 200 such sweeps, with a chance of 1 %."""

    def claims(effect: float, together: float, count: int) -> tuple[int, int]:
        sweeps = [
            collect_cells(random_cells(rng, effect, together), name="x", planned=60, failures={}) for _ in range(count)
        ]
        main = [next(e for e in key_effects(sweep, "") if e.key.name == "a").contrasts.values() for sweep in sweeps]
        both = [key_interactions(sweep, "")[0].contrasts.values() for sweep in sweeps]
        return tuple(sum(any(c.is_told for c in of) for of in found) for found in (main, both))  # type: ignore[return-value]

    main, both = claims(0.0, 0.0, 200)
    assert main <= 18
    assert both <= 18
    main, both = claims(1.0, 1.2, 40)
    assert main >= 36
    assert both >= 36


def test_blocks_with_a_missing_value_and_other_performers_do_not_count(rng: np.random.Generator) -> None:
    cells = [row for row in random_cells(rng, 1.0, 0.0) if row[1] != "walking_p1_01" or '"x"' in row[6]]
    others = [(*row[:5], "known", *row[6:]) for row in random_cells(rng, -1.0, 0.0)]
    cells = [(*row[:5], "new", *row[6:]) for row in cells]
    sweep = collect_cells(iter(cells + others), name="x", planned=120, failures={})
    new, known = (next(e for e in key_effects(sweep, kind) if e.key.name == "a") for kind in ("new", "known"))
    assert (len(new.units), len(known.units)) == (9, 10)
    assert (new.lowest, known.lowest) == (0, 1)
    assert sweep_sentence(sweep).count("Compared on ") == 2
    (alone,) = key_effects(
        collect_cells(iter([row for row in cells if row[6].endswith('"b": 0}')]), name="x", planned=20, failures={}),
        "new",
    )
    assert alone.key.name == "a"
    assert (
        key_interactions(
            collect_cells(
                iter([row for row in cells if row[6].endswith('"b": 0}')]), name="x", planned=20, failures={}
            ),
            "new",
        )
        == []
    )


def test_each_key_has_a_chart_for_each_scenario_told_in_words(folder: Path) -> None:
    alts = [str(attributes["alt"]) for tag, attributes in read(folder / "report.html").found if tag == "img"]
    assert len(alts) == 5, "the interaction first"
    for alt, key in zip(alts[1:], (RATE, RATE, NOISE, NOISE), strict=True):
        assert alt.startswith(f"{PRIMARY_METRIC} [deg] against {key}: ik ")
        assert "local_pca" not in alt, "all its cells failed"


def test_methods_stand_beside_each_other_in_every_scenario(folder: Path) -> None:
    sweep, said = read_sweep(folder), text_of(folder / "report.html")
    for scenario in range(2):
        for series in range(len(sweep.series)):
            found = sweep.statistic(PRIMARY_METRIC, sweep.select(scenario, series))
            assert f"{found.mean:.2f} ± {found.sd:.2f}" in said
            assert f"{found.mean:.2f} ± {found.sd:.2f}" in sweep_text(sweep)
    assert "walking n 7 boxing n 7 all n 14" in said.replace("\u00a0", " ").replace("  ", " ")


def test_failures_that_end_alike_are_one_with_the_command_that_tries_again(folder: Path) -> None:
    ((message, failed),) = group_failures(read_sweep(folder)).items()
    assert (len(failed), message) == (84, "ValueError: <b>no</b> pose & no plan")
    said = text_of(folder / "report.html")
    assert "84 cells: ValueError: <b>no</b> pose & no plan" in said
    assert "and 64 more" in said
    assert said.count("Traceback (most recent call last)") == 1
    command = sweep_command(folder)
    assert said.count(command) == 3
    assert f"{command} --cell {shlex.quote(failed[0])}" in said
    assert "FAILED 84, such as walking seed 1: local_pca on walking_p1_01" in sweep_text(read_sweep(folder))


def test_the_query_on_the_page_works(folder: Path) -> None:
    query = re.search(r'sqlite3 index\.sqlite "([^"]+)"', text_of(folder / "report.html"))
    assert query
    with CellIndex(folder, read_only=True) as index:
        assert len(index._db.execute(query[1]).fetchall()) == 4


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    ("plan", "said"),
    [
        (MeansPlan(failing=("ik", "local_pca", "dynamic_map")), "0 of 42 cells finished, 42 failed."),
        (
            MeansPlan(clips=1, unmeasured=("ik", "local_pca", "dynamic_map")),
            "Nothing was measured. 6 of 6 cells finished.",
        ),
        (MeansPlan(methods={"ik": 1.0}, clips=1), " ik: "),
        (MeansPlan(known=4), "dynamic_map (known) has the lowest mean joint-angle error, "),
        (MeansPlan(clips=1, unmeasured=("ik",)), "dynamic_map has the lowest mean joint-angle error, "),
    ],
)
def test_nothing_is_too_little_to_be_told(plan: MeansPlan, said: str, tmp_path: Path) -> None:
    page = write_sweep_page(planted_sweep(tmp_path / "out", plan))
    shown = text_of(page)
    assert said in shown
    assert said in f" {sweep_text(read_sweep(tmp_path / 'out'))}".replace("\n", " ")
    assert "nan" not in shown.lower().split()


def test_known_and_new_performers_are_never_pooled(tmp_path: Path) -> None:
    sweep = read_sweep(planted_sweep(tmp_path / "out", MeansPlan(known=4)))
    assert {f"ik ({kind})" for kind in ("known", "new")} < set(sweep.series)
    assert sweep_sentence(sweep).count("has the lowest mean joint-angle error") == 2


def test_a_mean_with_an_interval_is_over_units(tmp_path: Path) -> None:
    sweep = read_sweep(
        planted_sweep(tmp_path / "out", MeansPlan(behaviours=("walking",), vary={NOISE: ("clean", "default")}))
    )
    first, *others = sweep.clips
    takes = [name.rpartition(": ")[2].partition("@")[0] for name in sweep.clips]
    owner = {take: "Anna" if take == takes[0] else f"performer of {take}" for take in takes} | {takes[1]: "Anna"}
    shared, selected = replace(sweep, sampling=Sampling(owner)), sweep.select(0, 0)
    means = sweep.by_clip(PRIMARY_METRIC, selected)
    units = np.array([means[:2].mean(), *means[2:]])
    found = shared.statistic(PRIMARY_METRIC, selected, with_interval=True)
    assert found.mean == pytest.approx(units.mean())
    assert (found.low, found.high) == pytest.approx(mean_interval(units))
    assert shared.statistic(PRIMARY_METRIC, selected).mean == pytest.approx(means.mean())
    assert (found.units, found.clips) == (6, 7)
    assert sweep_page(shared).facts["Clips"] == "7 clips of 6 performers"
    drawn = sweep_chart(shared, shared.keys[0], 0, curves(shared, shared.keys[0], 0))
    assert "Mean over 6 units (7 clips)." in drawn.caption
    assert first != others[0]


def test_seeds_of_a_clip_are_one_clip(tmp_path: Path) -> None:
    sweep = read_sweep(planted_sweep(tmp_path / "out", MeansPlan(behaviours=("walking",), seeds=(1, 2, 3))))
    assert len(sweep) == 63
    assert sweep.statistic(PRIMARY_METRIC, sweep.select(0, 0)).clips == 7


@pytest.mark.usefixtures("undrawn")
def test_a_lead_that_clips_do_not_show_is_none(tmp_path: Path) -> None:
    few = planted_sweep(tmp_path / "few", MeansPlan(behaviours=("walking",), clips=5))
    alike = planted_sweep(tmp_path / "alike", MeansPlan(methods={"ik": 1.5, "local_pca": 1.5}))
    assert sweep_sentence(read_sweep(few)).endswith(
        "but cannot be called better than any of the other 2 (too few units: 5, of at least 6)."
    )
    assert sweep_sentence(read_sweep(alike)).endswith("(the interval contains zero and exceeds the margin).")
    for out in (few, alike):
        assert "<td><strong>" not in write_sweep_page(out).read_text(encoding="utf-8")


@pytest.mark.usefixtures("undrawn")
def test_a_cell_is_bold_where_its_method_is_better_than_all_others(tmp_path: Path) -> None:
    """Six performers are too few for 4 lines, as 4 * 2 / 2^6 is above 0.05, however many clips they have."""
    for clips, columns in ((6, 0), (10, 3)):
        plan = MeansPlan(methods={"ik": 3.0, "local_pca": 2.0, "dynamic_map": 1.0}, clips=clips)
        out = tmp_path / str(clips)
        page = write_sweep_page(planted_sweep(out, plan)).read_text(encoding="utf-8")
        sweep = read_sweep(out)
        over_all = sweep.statistic(PRIMARY_METRIC, sweep.select(series=sweep.series.index("dynamic_map"))).mean
        table = page.split(f'aria-label="{PRIMARY_METRIC}"')[-1].split("</table>")[0]
        bold = re.findall(r"<strong>([\d.]+)", table)
        assert len(bold) == columns
        assert not columns or f"{over_all:.2f}" in bold


def test_few_clips_have_a_mean_and_no_interval(tmp_path: Path) -> None:
    sweep = read_sweep(planted_sweep(tmp_path / "out", MeansPlan(clips=5, vary={NOISE: ("clean", "default")})))
    points = [point for curve in curves(sweep, sweep.keys[0], 0).values() for point in curve]
    assert len(points) == 6
    assert all(point.mean is not None and point.low is None for point in points)


def test_a_scenario_that_does_not_vary_a_key_has_no_chart_of_it() -> None:
    def cells() -> Any:
        for scenario, varied in (("a", '{"n":1}'), ("a", '{"n":2}'), ("b", "{}"), ("c", '{"n":1}')):
            yield (scenario, "clip", "ik", "pos", "none", "", varied, *([1.0] * len(READ_METRICS)))

    sweep = collect_cells(cells(), name="x", planned=4, failures={})
    assert scenarios_varying(sweep, sweep.keys[0]) == [0]


def test_methods_with_a_lag_are_named_and_ranked_apart(tmp_path: Path) -> None:
    """The late method has the lowest error of all; without its lag it would be the only best one."""
    methods = {"ik": 6.0, "good": 2.0, "late": 0.1}
    sweep = read_sweep(planted_sweep(tmp_path / "out", MeansPlan(clips=10, methods=methods, lags={"late": 2})))
    assert sweep.series == ("ik", "good", "late (lag 2)")
    causal, late, note = re.split(r"(?<=\.) (?=late \(lag 2\): |Methods that wait)", sweep_sentence(sweep))
    assert "good is best: " in causal
    assert "late" not in causal
    assert late.endswith("of 10 performers, with a lag of 2 frames. No other method was measured.")
    assert note == "Methods that wait for later frames are ranked apart from causal ones, each lag for itself."
    table = str(page_table(scenario_table(sweep, PRIMARY_METRIC)))
    assert re.findall(r'<th scope="row">([^<]*)</th><td><strong>', table) == ["good"]
    plain = read_sweep(planted_sweep(tmp_path / "plain", MeansPlan(clips=10, methods=methods)))
    assert "late is best: " in sweep_sentence(plain)
    assert "lag" not in sweep_sentence(plain)


def test_hostile_names_stay_text() -> None:
    """Names of clips and words of a scenario are a user's."""
    key = json.dumps(HOSTILE)
    rows = [
        (HOSTILE, HOSTILE, HOSTILE, HOSTILE, HOSTILE, "", f"{{{key}:{value}}}", *([1.0] * len(READ_METRICS)))
        for value in (key, '"b"')
    ]
    sweep = collect_cells(iter(rows), name=HOSTILE, planned=3, failures={HOSTILE: HOSTILE})
    raw = render_html(sweep_page(sweep))
    assert "<script>alert" not in raw
    assert raw.count("&lt;script&gt;alert(1)&lt;/script&gt;") > 5
    assert not re.search(r"(?:src|href)=\"(?!data:|#)", raw)
    assert HOSTILE in sweep_text(sweep)


def test_names_and_values_on_a_chart_do_not_meet() -> None:
    names = [f"method_{n}[neighbours={n}]" for n in range(12)]
    found = {
        n: (Statistic(1.0 + 0.1 * n, 7, 0.1, 0.9, 1.3), Statistic(None, 0), Statistic(1.2, 7))
        for n in range(len(names))
    }
    shown = select_curves(found)
    assert len(shown) == MAX_SERIES
    words = VariedKey("worn", ("head+torso+left_hand+right_hand+left_ankle+right_ankle+sternum", "a", "b"))
    for key in (words, VariedKey("n", ("1", "20", "400"), (1.0, 20.0, 400.0))):
        made: list[Figure] = []

        def draw(figure: Figure, key: VariedKey = key, made: list[Figure] = made) -> None:
            _draw(figure, key, shown, names)
            made.append(figure)

        draw_chart(
            "chart", "", "", "", draw, 2.7 if key.numbers else _dot_chart_height_in(key, len(shown)), width_in=4.2
        )
        texts_apart(made[0])


def test_many_cells_give_a_page_no_larger_than_few() -> None:
    def cells(count: int) -> Any:
        values = np.random.default_rng(1).uniform(1.0, 2.0, count)
        for n in range(count):
            method, clip = f"m{n % 5}", f"clip_{n // 20 % 30}"
            yield (
                "walking",
                clip,
                method,
                "pos",
                "none",
                "",
                f'{{"n":{n // 5 % 4}}}',
                *([values[n]] * len(READ_METRICS)),
            )

    failures = {f"cell {n}": "ValueError: the same" for n in range(1_000)}
    few, many = (
        render_html(
            sweep_page(collect_cells(cells(count), name="x", planned=count + 1_000, failures=failures)),
            with_charts=False,
        )
        for count in (600, 6_000)
    )
    assert len(many) < 1.05 * len(few) < 60_000


@pytest.mark.usefixtures("undrawn")
def test_the_verb_report_writes_the_same_page_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The verb reads the cells too: a sweep with a damaged one is refused."""
    out = planted_sweep(tmp_path / "out", MeansPlan(("walking",), clips=2, methods={"ik": 3.0, "mean_pose": 9.0}))
    page = write_sweep_page(out)
    before = page.read_bytes()
    assert main(["report", str(out)]) == 0
    assert page.read_bytes() == before
    assert str(page) in capsys.readouterr().out
    assert main(["report", str(out), "--methods", "ik", "--readme", str(out / "README.md")]) == 2
    cell = next((out / "cells").glob("*/cell.json"))
    cell.write_text(cell.read_text().replace("walking", "running"))
    assert main(["report", str(out)]) == 2
    assert str(cell) in capsys.readouterr().err
    assert page.read_bytes() == before


def test_a_folder_that_is_no_sweep_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadFile, match="no results of the harness; expected a run or a sweep"):
        write_sweep_page(tmp_path)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("width", [1280, 390])
def test_the_page_is_whole_and_quiet(browser: Any, folder: Path, width: int) -> None:
    images, first = is_whole_and_quiet(browser, folder / "report.html", width)
    assert images == 5
    assert first.startswith("tracker.rate_hz: 120 is best")
