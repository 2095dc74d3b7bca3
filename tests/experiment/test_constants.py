"""No constant was chosen on a clip that a scenario judges (docs/notes/constants.toml)."""

import csv
import os
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from harness.bench.physics import first_fix
from harness.bench.physics.truth import SEEDS
from harness.core.package_data import data_folder
from harness.core.split import GUARD_S, ClipPart

ROOT = Path(__file__).parents[2]
RATE_HZ = 120.0
CONTENT = tomllib.loads((ROOT / "docs" / "notes" / "constants.toml").read_text(encoding="utf-8"))
CHOSEN = {(clip, entry["method"]) for entry in CONTENT["constant"] for clip in entry["clips"]}
CHOOSING = ("tune_", "validate_")


def real_scenarios() -> Iterator[tuple[Path, list[str]]]:
    """Files of scenarios on real motion, and their test clips."""
    for path in sorted(data_folder("scenarios").rglob("*.toml")):
        motion = tomllib.loads(path.read_text(encoding="utf-8")).get("motion", {})
        if motion.get("source") == "cmu":
            yield path, motion["test"]


def name_of(path: Path) -> str:
    """The path below scenarios/, without its ending: two folders may hold scenarios of one name."""
    return path.relative_to(data_folder("scenarios")).with_suffix("").as_posix()


JUDGING = {name_of(path): tests for path, tests in real_scenarios() if not path.stem.startswith(CHOOSING)}
SEARCHES = {name_of(path): tests for path, tests in real_scenarios() if path.stem.startswith(CHOOSING)}


def overlap(first: str, second: str) -> bool:
    """Whether two parts of one take are less than the guard time apart; whole takes always are."""
    a, b = ClipPart.parse(first), ClipPart.parse(second)
    if a.clip != b.clip:
        return False
    if (a.start, a.end) == (0.0, 1.0) or (b.start, b.end) == (0.0, 1.0):
        return True
    guard = GUARD_S * RATE_HZ / int(CONTENT["frames"][a.clip])
    return a.start < b.end + guard - 1e-9 and b.start < a.end + guard - 1e-9


def test_parts_overlap_when_the_guard_does() -> None:
    guard = RATE_HZ / CONTENT["frames"]["13_17"]
    assert overlap("13_17@0.00-0.20", f"13_17@{0.2 + 0.9 * guard:.4f}-0.40")
    assert not overlap("13_17@0.00-0.20", f"13_17@{0.2 + 1.1 * guard:.4f}-0.40")
    assert overlap("13_17@0.30-0.40", "13_17")
    assert not overlap("13_17@0.30-0.40", "14_02@0.30-0.40")


def test_scenarios_on_real_motion_are_found() -> None:
    assert {"boxing", "jumping", "papers/liu2011/cmu_blocks", "papers/kim2012/cmu_five_boxing"} <= set(JUDGING)
    assert len(JUDGING) + len(SEARCHES) == len(list(real_scenarios()))
    assert {"tune_dynamic_map_literal", "validate_boxing", "validate_new_performers"} <= set(SEARCHES)


@pytest.mark.parametrize("name", JUDGING)
def test_nothing_is_judged_where_a_constant_was_chosen(name: str) -> None:
    clashes = [(test, clip, method) for test in JUDGING[name] for clip, method in CHOSEN if overlap(test, clip)]
    assert not clashes


@pytest.mark.parametrize("name", SEARCHES)
def test_the_record_names_every_clip_of_a_search(name: str) -> None:
    assert set(SEARCHES[name]) <= {clip for clip, _ in CHOSEN}


@pytest.mark.parametrize("name", ["walking", "new_performers", "jumping", "boxing"])
def test_built_in_motion_was_not_made_like_the_clips_of_the_tables(name: str) -> None:
    looked_at = [clip for entry in CONTENT["motion"] for clip in entry["clips"]]
    assert looked_at
    assert not [(test, clip) for test in JUDGING[name] for clip in looked_at if overlap(test, clip)]


def test_the_seeds_of_the_truth_table_chose_no_default_of_the_physics() -> None:
    (entry,) = (entry for entry in CONTENT["constant"] if entry["method"] == "physics of the simulated tracker")
    assert max(SEEDS) < entry["seeds_from"]
    judged = range(first_fix.FIRST_START, first_fix.FIRST_START + first_fix.STARTS * len(SEEDS))
    assert not set(judged) & set(range(entry["starts"][0], entry["starts"][1] + 1))


def test_lengths_are_those_of_the_manifest() -> None:
    folder = os.environ.get("HARNESS_MOCAP")
    if not folder:
        pytest.skip("no real motion: set HARNESS_MOCAP to a folder with CMU clips")
    with (Path(folder) / "manifest.csv").open(newline="", encoding="utf-8") as file:
        frames = {Path(row["path"]).stem: row["frames"] for row in csv.DictReader(file) if row["path"].endswith("amc")}
    assert {clip: str(count) for clip, count in CONTENT["frames"].items()} == {c: frames[c] for c in CONTENT["frames"]}
