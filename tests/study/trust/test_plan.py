"""Plans of trust studies: what is refused, and what changes the digest."""

from pathlib import Path

import pytest

from harness.errors import BadFile, BadInput, UnknownName
from harness.study.trust.plan import load_plan, plan_digest, unit_file

PLAN = """
kind = "trust plan"
scenario = "demo"
methods = ["ik", "mean_pose"]
[margins]
joint_angle_mean_deg = 0.5
mpjpe_mm = 5
[stations]
two = ["head", "torso"]
"""


def write(folder: Path, text: str = PLAN) -> Path:
    path = folder / "plan.toml"
    path.write_text(text)
    return path


def test_a_plan_is_read_with_its_defaults(tmp_path: Path) -> None:
    plan = load_plan(write(tmp_path))
    assert plan.margins == {"joint_angle_mean_deg": 0.5, "mpjpe_mm": 5.0}
    assert plan.ranked_metric == "joint_angle_mean_deg"
    assert (plan.level, plan.seeds, plan.unit) == (0.05, (1, 2, 3, 4, 5), "")
    assert unit_file(plan, tmp_path / "plan.toml") is None


def test_stations_of_a_set_are_in_the_order_of_the_scenario(tmp_path: Path) -> None:
    named = load_plan(write(tmp_path)).stations["two"]
    turned = load_plan(write(tmp_path, PLAN.replace('"head", "torso"', '"torso", "head"'))).stations["two"]
    assert sorted(named) == ["head", "torso"]
    assert named == turned


def test_without_sets_all_stations_are_one_set(tmp_path: Path) -> None:
    plan = load_plan(write(tmp_path, PLAN.partition("[stations]")[0]))
    assert {name: len(stations) for name, stations in plan.stations.items()} == {"all": 6}


@pytest.mark.parametrize(
    ("old", "new", "error", "words"),
    [
        ("[margins]\njoint_angle_mean_deg = 0.5\nmpjpe_mm = 5\n", "", BadFile, "no margins"),
        ('kind = "trust plan"', 'kind = "placement"', BadFile, "a placement study; expected a trust plan"),
        ("mpjpe_mm = 5", "mpjpe_mm = -5", BadFile, "mpjpe_mm"),
        ("mpjpe_mm = 5", "step_mean_ms = 5", UnknownName, "step_mean_ms"),
        ('"head", "torso"', '"head", "tail"', UnknownName, "tail"),
        ('"head", "torso"', '"head", "head"', BadInput, "once"),
        ('"ik", "mean_pose"', '"ik", "ik"', BadFile, "methods"),
        ('"ik", "mean_pose"', "", BadFile, "methods"),
        ("[margins]", 'rank_by = "mpjre_deg"\n[margins]', UnknownName, "mpjre_deg"),
        ("[margins]", "schema = 2\n[margins]", BadFile, "schema 2"),
        ("[margins]", "seeds = [1, 1]\n[margins]", BadFile, "seeds"),
        ("[margins]", "levle = 0.1\n[margins]", UnknownName, "level"),
        ("[margins]", "level = 0.7\n[margins]", BadFile, "0.2"),
        ("[margins]", 'scenario = "nothing"\n[margins]', BadFile, "not TOML"),
        ('scenario = "demo"', 'scenario = "nothing"', UnknownName, "nothing"),
        ("[stations]", '[parameters]\n"tracker.rate_hz" = [40.0]\n[stations]', UnknownName, "tracker.rate_hz"),
        ("[stations]", '[parameters]\n"motion.thin_to" = 40\n[stations]', BadInput, "list"),
        ("[stations]", '[parameters]\n"motion.thin_to" = [-1]\n[stations]', BadInput, "thin_to"),
    ],
)
def test_what_a_plan_may_not_say(tmp_path: Path, old: str, new: str, error: type, words: str) -> None:
    assert old in PLAN
    with pytest.raises(error, match=words):
        load_plan(write(tmp_path, PLAN.replace(old, new)))


def test_layout_and_comments_leave_the_digest_alone(tmp_path: Path) -> None:
    before = plan_digest(write(tmp_path))
    assert len(before) == 64
    assert plan_digest(write(tmp_path, "# a comment\n" + PLAN.replace("0.5", "0.50"))) == before


@pytest.mark.parametrize(
    ("old", "new"),
    [("0.5", "0.6"), ('"ik", ', '"ik:previous", '), ('"head", ', ""), ("[margins]", "seeds = [1, 2]\n[margins]")],
)
def test_a_changed_plan_has_another_digest(tmp_path: Path, old: str, new: str) -> None:
    before = plan_digest(write(tmp_path))
    assert plan_digest(write(tmp_path, PLAN.replace(old, new))) != before


def test_a_changed_scenario_changes_the_digest_and_a_changed_unit_file_does_not(tmp_path: Path) -> None:
    shipped = Path("scenarios/demo.toml").read_text()
    (tmp_path / "own.toml").write_text(shipped)
    plan = write(tmp_path, PLAN.replace('"demo"', '"own.toml"\nunit = "unit.toml"'))
    (tmp_path / "unit.toml").write_text("one")
    before = plan_digest(plan)
    (tmp_path / "unit.toml").write_text("other")
    assert plan_digest(plan) == before
    (tmp_path / "own.toml").write_text(shipped.replace("longest_s = 4.0", "longest_s = 3.0"))
    assert plan_digest(plan) != before
