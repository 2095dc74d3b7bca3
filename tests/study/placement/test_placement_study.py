"""Placement studies from their file to their findings, with a method of which the answer is known."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import pytest

import harness
from harness.cli import main
from harness.compare import Sampling
from harness.errors import BadFile, BadInput, HarnessError, Outcome, UnknownName
from harness.experiment import read_status
from harness.experiment.scenarios import load_scenario
from harness.results import open_study
from harness.results.files import FINDINGS
from harness.results.findings import PlacementFindings, StatisticalPower, read_placement, write_placement
from harness.simulate import TrackerConfig
from harness.study.placement import placement_study
from harness.study.placement.config import load_placement_study, shipped_placements
from harness.study.placement.placement_study import run_placement
from harness.study.placement.plan import plan_placement
from harness.study.placement.set_results import link_rate_hz
from tests.results.finish import folder_bytes

SCENARIO = """
schema = 1
unit = "clip"
methods = ["ik"]
noise = "clean"
[motion]
source = "builtin"
body = "common"
behaviours = ["walking"]
longest_s = 1.5
test = []
[tracker]
rate_hz = 20.0
[stations]
torso = { bone = "thorax" }
"""
STUDY = """
schema = 1
kind = "placement"
title = "Which one does it read?"
scenario = "walk"
methods = ["tests.study.placement.one_station:OneStation"]
metric = "root_angle_deg"
[[candidate]]
name = "hand"
bone = "rhand"
along = 1.0
around_deg = 90.0
pair = "each"
[[candidate]]
name = "pelvis"
bone = "lhipjoint"
along = 0.0
around_deg = 165.0
"""


SEVEN = """test = [
    "walking_p1_01@0.20-0.25", "walking_p1_01@0.30-0.35", "walking_p1_01@0.40-0.45", "walking_p1_01@0.50-0.55",
    "walking_p1_01@0.60-0.65", "walking_p1_01@0.70-0.75", "walking_p1_01@0.80-0.85",
]
"""
FEW = 'test = ["walking_p1_01@0.20-0.25", "walking_p1_01@0.30-0.35"]\n'


def written(folder: Path, *tables: str, study: str = STUDY, clips: str = FEW) -> Path:
    """The file of a study, and beside it its scenario."""
    (folder / "walk.toml").write_text(SCENARIO.replace("test = []\n", clips))
    path = folder / "which.toml"
    path.write_text("\n".join([study, *tables]))
    return path


ALL_MODES = """
[ablate]
[add]
base = ["hand"]
[greedy]
most = 3
[exhaustive]
most = 3
[[claim]]
text = "the hands suffice"
source = "nobody"
set = ["hand"]
[[condition]]
name = "at the usual noise"
changes = { noise = "default" }
"""


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path, PlacementFindings]:
    """A study with every mode but `refine`."""
    folder = tmp_path_factory.mktemp("study")
    path = written(folder, "[ablate]", clips=SEVEN, study=STUDY.replace("metric =", "condition_size = 1\nmetric ="))
    run_placement(path, folder / "out")  # of one mode first
    path.write_text(path.read_text().replace("[ablate]", ALL_MODES))
    findings, outcome = run_placement(path, folder / "out")
    assert outcome is Outcome.PASS
    return path, folder / "out", findings


def test_every_mode_finds_the_one_station_that_is_read(done: tuple[Path, Path, PlacementFindings]) -> None:
    _, _, findings = done
    rankings = {(ranking.mode, ranking.title): ranking for ranking in findings.rankings}
    ablated, added, ones, twos, _ = rankings.values()
    assert [row.stations for row in ablated.rows][-1] == ("right_hand", "left_hand")
    assert (ablated.rows[-1].rank_low, ablated.rows[-1].rank_high) == (3, 3)
    assert [row.stations for row in added.rows] == [("right_hand", "left_hand", "pelvis")]
    assert ones.rows[0].stations == ("pelvis",)
    assert [row.tied for row in ones.rows] == [True, False, False]
    assert {row.stations for row in twos.rows if row.tied} == {("left_hand", "pelvis"), ("right_hand", "pelvis")}
    (search,) = findings.searches
    assert search.steps[0].changed == "+ pelvis"
    assert [step.difference for step in search.steps[1:]] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_what_is_necessary_is_worth_much_and_what_is_useless_nothing(
    done: tuple[Path, Path, PlacementFindings],
) -> None:
    _, _, findings = done
    for contribution in findings.contributions:
        if contribution.candidate == "pelvis":
            assert contribution.low is not None
            assert contribution.low > 0.5
        else:
            assert contribution.difference == pytest.approx(0.0, abs=1e-12)
    needed = findings.of(("pelvis",))
    assert needed is not None
    assert needed.mean == pytest.approx(0.0, abs=1e-3)  # float32 on the wire


def test_modes_share_their_cells(done: tuple[Path, Path, PlacementFindings]) -> None:
    """Seven sets of three candidates on seven clips, and three of them at another noise: not one cell more."""
    path, out, findings = done
    cells = {folder.name: folder.stat().st_mtime_ns for folder in (out / "cells").iterdir()}
    assert len(cells) == 7 * 7 + 7 * 3
    again, _ = run_placement(path, out)
    assert {folder.name: folder.stat().st_mtime_ns for folder in (out / "cells").iterdir()} == cells
    assert read_placement(out / FINDINGS) == again
    assert replace(again, circumstances={}, power=None) == replace(findings, circumstances={}, power=None)


def test_a_study_that_was_killed_goes_on_to_the_same_findings(done: tuple[Path, Path, PlacementFindings]) -> None:
    path, out, findings = done
    (out / FINDINGS).unlink()
    cells = sorted((out / "cells").iterdir())
    for folder in cells[::20]:
        shutil.rmtree(folder)
    again, outcome = run_placement(path, out)
    assert outcome is Outcome.PASS
    assert sorted((out / "cells").iterdir()) == cells
    assert replace(again, circumstances={}, power=None) == replace(findings, circumstances={}, power=None)


def test_a_study_is_running_until_its_findings_are_written(
    done: tuple[Path, Path, PlacementFindings], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also between two of its searches, when no cell is computed; and no second process may work there."""
    path, out, _ = done
    seen = []

    def write(file: Path, findings: PlacementFindings) -> None:
        seen.append(read_status(file.parent).running)
        with pytest.raises(BadInput, match="Another process uses"):
            run_placement(path, out)
        write_placement(file, findings)

    monkeypatch.setattr(placement_study, "write_placement", write)
    run_placement(path, out)
    assert seen == [True]
    assert not read_status(out).running


def test_a_set_that_does_not_suffice_is_said_so(done: tuple[Path, Path, PlacementFindings]) -> None:
    _, _, findings = done
    assert [claim.verdict for claim in findings.claims] == ["not reproduced", "not reproduced"]
    assert "pelvis" in findings.claims[0].text
    assert all("tested on the clips on which the best other set was chosen" in claim.why for claim in findings.claims)


def test_conditions_rank_the_same_sets(done: tuple[Path, Path, PlacementFindings]) -> None:
    _, _, findings = done
    own, noisy = findings.conditions
    assert own.best == noisy.best == {"1": ("pelvis",)}
    assert (own.kind, noisy.kind) == ("own", "noise")
    assert findings.compared == (("right_hand",), ("left_hand",), ("pelvis",))
    assert own.selection_stability == 1.0
    assert len(findings.agreements) == 1


def test_a_condition_that_moves_a_station_has_cells_of_its_own(tmp_path: Path) -> None:
    """The one station that is read is moved with its true mount known, so that the error stays; the cells do not."""
    moved = '[[condition]]\nname = "higher"\nchanges = { stations = { pelvis = { around_deg = 90.0 } } }'
    study = STUDY.replace("metric =", "condition_size = 1\nmetric =")
    findings, outcome = run_placement(written(tmp_path, "[exhaustive]\nmost = 1", moved, study=study), tmp_path / "out")
    assert outcome is Outcome.PASS
    assert [condition.name for condition in findings.conditions][1:] == ["higher"]
    cells = [json.loads((cell / "cell.json").read_text()) for cell in (tmp_path / "out" / "cells").iterdir()]
    places = [cell["defined_by"]["stations"]["pelvis"] for cell in cells if cell["stations"] == ["pelvis"]]
    assert sorted(place["around_deg"] for place in places) == [90.0, 90.0, 165.0, 165.0]


def test_a_cell_that_fails_stops_nothing_and_is_told(tmp_path: Path) -> None:
    changes = (
        '[exhaustive]\nmost = 1\n[changes.components]\nmount_slip = [{ station = "pelvis" }]'  # nobody else has it
    )
    findings, outcome = run_placement(written(tmp_path, changes), tmp_path / "out")
    assert outcome is Outcome.INCOMPLETE
    assert len(findings.failures) == 2 * 2  # sets without a pelvis
    assert [[row.stations for row in ranking.rows] for ranking in findings.rankings] == [[("pelvis",)]]
    assert any(note.startswith("not ranked: right_hand was measured on 0 of 2") for note in findings.notes)


@pytest.mark.parametrize(
    ("tables", "said"),
    [
        ([""], "no search mode"),
        (["[exhaustive]\nmost = 13"], "from 1 to 12"),
        (["[exhaustive]\nmost = 2\nmost_cells = 11"], "6 sets of up to 2 of 3 stations are 12 cells"),
        (["[greedy]\nmost = 2\nbase = ['knee']"], "greedy.base has 'knee'"),
        (["[add]\nbase = ['pelvis']\nof = ['pelvis']"], "add.of: 0 stations"),
        (["[refine]\nset = ['pelvis']\nalong = []"], "equally many of both"),
        (["[refine]\nset = ['pelvis']"], "with 2 units, none of 4 moves .* 8 units"),
        (["[refine]\nset = ['pelvis']\nalong = [0.1, 0.0]"], "steps above 0"),
        (["[ablate]\n[changes]\nmethods = ['ik']"], "The study defines these keys"),
        (["[ablate]\n[changes]\nnoise = 'loud'"], "loud"),
        (["[ablate]\n[[condition]]\nname = 'a'\n[[condition]]\nname = 'a'"], "distinct names"),
        (["[ablate]\n[[claim]]\ntext = 't'\nsource = 's'\nset = ['knee']"], "has 'knee'"),
        (
            ["[[candidate]]\nname = 'far'\nbone = 'head'\nalong = 2.0\n[ablate]"],
            "along = 2.0 must be a number from 0 to 1",
        ),
        (["[[candidate]]\nname = 'x'\nbone = 'headd'\n[ablate]"], "Did you mean 'head'"),
        (["[abblate]"], "Did you mean 'ablate'"),
    ],
)
def test_what_makes_no_sense_is_refused_before_anything_is_written(
    tables: list[str], said: str, tmp_path: Path
) -> None:
    with pytest.raises(HarnessError, match=said):
        run_placement(written(tmp_path, *tables), tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('kind = "sweep"', "kind = 'sweep'"),
        ("schema = 2", "schema 2"),
        ('metric = "mpjpe"', "no metric called 'mpjpe'"),
        ('metric = "lag_ms"', "metric of accuracy, smoothness or time"),
        ('held_out = ["walking_p1_01@0.20-0.25"]', "also a test clip"),
        ('held_out = ["walking_p999_01"]', "walking_p999_01"),
        ("methods = []", "no methods"),
        ('methods = ["nobody"]', "nobody"),
        ('scenario = "runs"', "runs"),
    ],
)
def test_a_wrong_line_is_named(line: str, said: str, tmp_path: Path) -> None:
    key = line.partition(" ")[0]
    lines = [old for old in STUDY.splitlines() if not old.startswith(f"{key} ")]
    with pytest.raises(HarnessError, match=said):
        run_placement(written(tmp_path, "[ablate]", study="\n".join([line, *lines])), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_more_stations_run_at_the_rate_that_the_line_carries() -> None:
    """A record of 38 bytes takes 380 bits: 303.2 of them go through 115200 baud (docs/is900.md 2)."""
    base = replace(load_scenario("demo"), tracker=TrackerConfig(rate_hz=200.0))
    rates = [link_rate_hz(base, stations, link=True) for stations in (1, 2, 3, 4, 5)]
    assert rates == pytest.approx([180.0, 151.579, 101.053, 75.789, 60.632], abs=1e-3)
    assert link_rate_hz(base, 5, link=False) == 200.0
    slow = replace(base, tracker=TrackerConfig(rate_hz=40.0, baud=9600))
    assert link_rate_hz(slow, 5, link=True) == pytest.approx(9600 / 380 / 5)
    assert link_rate_hz(replace(base, tracker=TrackerConfig(rate_hz=40.0)), 5, link=True) == 40.0
    with pytest.raises(BadInput, match=r"carries 12 stations at 0\.26 Hz"):
        link_rate_hz(replace(base, tracker=TrackerConfig(baud=1200)), 12, link=True)


@pytest.fixture(scope="module")
def judged_elsewhere(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, PlacementFindings]:
    """A study of two methods on a slow line, whose choices are judged on another clip."""
    folder = tmp_path_factory.mktemp("slow")
    more = 'link = true\ncondition_size = 1\nheld_out = ["walking_p1_01@0.90-0.95"]\nmetric ='
    study = STUDY.replace("metric =", more).replace(
        'OneStation"]', 'OneStation", "tests.study.placement.one_station:NoStation"]'
    )
    path = written(folder, "[exhaustive]\nmost = 2\n[changes.tracker]\nbaud = 9600", study=study)
    findings, outcome = run_placement(path, folder / "out")
    assert outcome is Outcome.PASS
    return folder, findings


def test_a_study_whose_line_drops_most_records_is_not_comparable(tmp_path: Path) -> None:
    """One station at 20 Hz needs 7,600 bit/s. Without `link` the rate stays, and 2400 baud carry a third."""
    findings, outcome = run_placement(written(tmp_path, "[ablate]\n[changes.tracker]\nbaud = 2400"), tmp_path / "out")
    assert outcome is Outcome.NOT_COMPARABLE
    assert any("THE LINK IS TOO SLOW" in note for note in findings.notes)


def test_the_rate_of_a_set_is_that_of_its_size(judged_elsewhere: tuple[Path, PlacementFindings]) -> None:
    folder, findings = judged_elsewhere
    rates = {len(tried.stations): tried.rate_hz for tried in findings.tried}
    assert rates == pytest.approx({1: 20.0, 2: 9600 / 380 / 2})
    assert "2 at 12.63 Hz" in findings.link
    cells = [json.loads((cell / "cell.json").read_text()) for cell in (folder / "out" / "cells").iterdir()]
    assert {len(cell["stations"]): cell["rate_hz"] for cell in cells} == pytest.approx(rates)


def test_what_was_chosen_is_judged_on_clips_that_chose_nothing(
    judged_elsewhere: tuple[Path, PlacementFindings],
) -> None:
    folder, findings = judged_elsewhere
    one, two = findings.best
    assert (one.held_out_clips, one.of, two.of) == (1, 3, 3)
    assert one.held_out is not None
    chosen_on = set(map(Sampling(unit="clip").unit_of, load_scenario(folder / "walk.toml").motion.test))
    assert all(set(tried.errors) == chosen_on for tried in findings.tried)
    assert len(list((folder / "out" / "cells").iterdir())) == 2 * (2 * 6 + 2)


def test_methods_count_alike_and_rank_for_themselves(judged_elsewhere: tuple[Path, PlacementFindings]) -> None:
    _, findings = judged_elsewhere
    own, reads_it, reads_nothing = findings.conditions
    assert [each.kind for each in findings.conditions] == ["own", "method", "method"]
    assert own.best == reads_it.best == {"1": ("pelvis",)}
    for mean, one, other in zip(own.means, reads_it.means, reads_nothing.means, strict=True):
        assert mean is not None
        assert one is not None
        assert other is not None
        assert mean == pytest.approx((one + other) / 2.0)
    assert reads_it.means[2] == pytest.approx(0.0, abs=1e-3)
    assert reads_nothing.means[0] == pytest.approx(reads_nothing.means[2])


@pytest.mark.parametrize("path", shipped_placements(), ids=lambda path: path.stem)
def test_every_shipped_study_is_ready_to_be_done(path: Path) -> None:
    ready = plan_placement(path.stem, None)
    assert ready.study == load_placement_study(path)
    assert ready.held_out is not None
    assert len(ready.held_out.motion.test) >= 6
    with pytest.raises(BadFile, match="a placement study; expected a scenario"):
        load_scenario(path)


def test_the_study_of_the_docs_is_ready_to_be_done(tmp_path: Path) -> None:
    page = Path(harness.__file__).parent.parent / "docs" / "studies.md"
    (text,) = re.findall(r"```toml\n(schema = 1\nkind = \"placement\".*?)```", page.read_text(), re.DOTALL)
    (tmp_path / "mine.toml").write_text(text)
    ready = plan_placement(tmp_path / "mine.toml", None)
    assert ready.scenario.components == {"soft_tissue": {}, "strap_slip": {"share": 0.2}}
    assert len(ready.groups) == 2 + 1 + 12
    assert ready.rate_hz(5) == 40.0


def test_studies_that_do_not_exist_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UnknownName, match="Did you mean 'walking'"):
        load_placement_study("walkin")
    with pytest.raises(BadInput, match="harness placement walking"):
        load_placement_study("placement_walking")
    with pytest.raises(BadFile, match="no such file"):
        load_placement_study(tmp_path / "none.toml")
    with pytest.raises(BadFile, match="a scenario; expected a placement study"):
        load_placement_study("scenarios/demo.toml")


def test_a_second_command_changes_nothing_while_the_first_writes(tmp_path: Path) -> None:
    path, out = written(tmp_path, "[ablate]"), tmp_path / "out"
    with open_study(out, {"placement": "which", "motion": "built-in performer", "seed": 1}):
        before = folder_bytes(out)
        with pytest.raises(BadInput, match="Another process uses"):
            run_placement(path, out)
        assert folder_bytes(out) == before


def test_a_folder_of_another_study_is_left_alone(tmp_path: Path) -> None:
    with open_study(tmp_path / "out", {"placement": "another", "motion": "x", "seed": 1}):
        pass
    before = (tmp_path / "out" / "study.json").read_bytes()
    with pytest.raises(BadInput, match="holds another study"):
        run_placement(written(tmp_path, "[ablate]"), tmp_path / "out")
    assert (tmp_path / "out" / "study.json").read_bytes() == before


def test_the_verb_prints_what_came_out_and_names_the_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, "[exhaustive]\nmost = 1")
    words = ["placement", str(path), "--out", str(tmp_path / "out"), "--jobs", "1"]
    assert main(words) == 0
    printed = capsys.readouterr().out
    assert "pelvis" in printed
    assert printed.rstrip().endswith("pass")
    for line in ("findings: ", "report: "):
        (file,) = [text.removeprefix(line) for text in printed.splitlines() if text.startswith(line)]
        assert Path(file).is_file()
    path.write_text(path.read_text().replace("[exhaustive]", "[exhausting]"))
    assert main(words) == 2


def test_a_number_of_stations_is_asked_about_once(tmp_path: Path) -> None:
    path = written(tmp_path, "[exhaustive]\nmost = 2", study=STUDY.replace("metric =", "sizes = [2, 2]\nmetric ="))
    with pytest.raises(BadFile, match="sizes has a number twice"):
        load_placement_study(path)


def test_the_pilot_is_announced_before_the_other_cells_and_is_part_of_the_study(tmp_path: Path) -> None:
    tables = ["[exhaustive]", "fewest = 1", "most = 1"]
    study = STUDY.replace("metric =", "sizes = [1]\nmetric =")
    path = written(tmp_path, *tables, study=study)
    announced: list[StatisticalPower] = []

    def announce(news: StatisticalPower | str) -> None:
        assert isinstance(news, StatisticalPower)
        announced.append(news)
        assert not (tmp_path / "out" / FINDINGS).exists()

    findings, _ = run_placement(path, tmp_path / "out", announce=announce, jobs=2)
    (power,) = announced
    assert (power.clips, power.sets, power.least_clips, power.pilot_sets, power.shown) == (2, 3, 7, 3, None)
    assert power.cell_s is not None
    assert power.duration_s == pytest.approx(3 * 2 * power.cell_s / 2.0)
    assert power.least_duration_s == pytest.approx(3 * 7 * power.cell_s / 2.0)
    assert findings.power == power
    assert len(list((tmp_path / "out" / "cells").iterdir())) == 3 * 2
    assert findings.sizes == (1,)


def test_clips_of_one_performer_are_one_unit(tmp_path: Path) -> None:
    path = written(tmp_path, "[exhaustive]", "fewest = 1", "most = 1")
    scenario = tmp_path / "walk.toml"
    scenario.write_text(scenario.read_text().replace('unit = "clip"', 'unit = "performer"'))
    findings, _ = run_placement(path, tmp_path / "out")
    cells = [json.loads((cell / "cell.json").read_text()) for cell in (tmp_path / "out" / "cells").iterdir()]
    for tried in findings.tried:
        errors = [cell["metrics"]["root_angle_deg"] for cell in cells if cell["stations"] == list(tried.stations)]
        assert len(errors) == 2
        assert tried.errors == {"performer p1": pytest.approx(sum(errors) / 2.0)}
    assert findings.power is not None
    assert findings.power.clips == 1
