"""Stored errors: what is written comes back, and what is damaged, edited or malformed is refused."""

import json
from pathlib import Path

import pytest

from harness.bench.accuracy import clip_errors
from harness.bench.accuracy.clip_errors import ANGLE, SILENT_ANGLE, ClipErrors, read_errors, write_errors
from harness.bench.accuracy.conditions import CONDITIONS, SEEDS
from harness.bench.accuracy.targets import evaluate_targets
from harness.errors import BadFile, BadInput
from harness.experiment.scenarios import load_scenario
from harness.results.files import insert_digest
from tests.bench.accuracy.planted import COMMIT, errors, stored

ROOT = Path(clip_errors.__file__).parents[3]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A file of planted errors."""
    write_errors(tmp_path / "errors.json", stored(errors(1.5)))
    return tmp_path / "errors.json"


def test_errors_come_back_as_they_were_written(path: Path) -> None:
    found, expected = read_errors(path), stored(errors(1.5))
    assert (found.method, found.commit, found.seeds) == ("dynamic_map", COMMIT, SEEDS)
    assert found.conditions.keys() == expected.conditions.keys()
    for name, by_clip in expected.conditions.items():
        assert list(found.conditions[name]) == list(by_clip)
        for clip, planted in by_clip.items():
            back = found.conditions[name][clip]
            assert (back.behaviour, back.performer) == (planted.behaviour, planted.performer)
            assert back.by_metric.keys() == planted.by_metric.keys()
            for metric, values in planted.by_metric.items():
                assert back.by_metric[metric] == pytest.approx(values, rel=1e-5)
    assert found.title == "dynamic_map of 40f3d61"


def test_a_clip_is_one_line_of_the_file(path: Path) -> None:
    clips = sum(len(by_clip) for by_clip in errors(1.5).values())
    assert sum(ANGLE in line for line in path.read_text().splitlines()) == clips


def test_a_value_that_was_not_measured_stays_so(tmp_path: Path) -> None:
    by_metric = dict(errors(1.0)["boxing, clean"]["boxing_known_0"].by_metric) | {"foot_skate_mm_s": (None,)}
    one = {"boxing, clean": {"a": ClipErrors("boxing", "known", by_metric)}}
    write_errors(tmp_path / "one.json", stored(one))
    back = read_errors(tmp_path / "one.json").conditions["boxing, clean"]["a"]
    assert back.by_metric["foot_skate_mm_s"] == (None,)
    assert back.mean("foot_skate_mm_s") is None


def test_an_edited_file_is_refused(path: Path) -> None:
    path.write_text(path.read_text().replace('"known"', '"new"', 1))
    with pytest.raises(BadFile, match="digest"):
        read_errors(path)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadFile, match=r"none\.json"):
        read_errors(tmp_path / "none.json")


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"schema": 2}, "schema 2"),
        ({"seeds": ["1"]}, "seed '1'"),
        ({"conditions": None}, "items"),
        ({"conditions": {"boxing, clean": {"a": {}}}}, ANGLE),
    ],
)
def test_a_malformed_file_is_refused(path: Path, change: dict[str, object], named: str) -> None:
    content = json.loads(path.read_text()) | change
    del content["sha256"]
    path.write_text(insert_digest(json.dumps(content, indent=1)))
    with pytest.raises(BadFile, match=named):
        read_errors(path)


@pytest.mark.parametrize("values", [[-1.0], [1.0, 2.0], ["1"], [True], [None], 1.0])
def test_impossible_values_are_refused(path: Path, values: object) -> None:
    content = json.loads(path.read_text())
    del content["sha256"]
    content["conditions"]["boxing, clean"]["boxing_known_0"][ANGLE] = values
    path.write_text(insert_digest(json.dumps(content, indent=1)))
    with pytest.raises(BadFile, match=ANGLE):
        read_errors(path)


def test_fewer_seeds_are_the_first_ones() -> None:
    first = stored(errors(1.5)).first_seeds(SEEDS[:2])["boxing, default"]["boxing_known_0"]
    assert first.by_metric[ANGLE] == pytest.approx((1.3, 1.4))
    assert first.mean(ANGLE) == pytest.approx(1.35)


@pytest.mark.parametrize("seeds", [(), (2,), (1, 2, 3, 4, 5, 6)])
def test_other_seeds_are_refused(seeds: tuple[int, ...]) -> None:
    with pytest.raises(BadInput, match="seeds"):
        stored(errors(1.5)).first_seeds(seeds)


def test_the_shipped_errors_are_those_of_the_scenarios() -> None:
    shipped = read_errors(ROOT / clip_errors.DEFAULT_BASELINE)
    assert shipped.commit.startswith("40f3d61")
    assert shipped.seeds == SEEDS
    assert list(shipped.conditions) == [str(condition) for condition in CONDITIONS]
    for condition in CONDITIONS:
        by_clip = shipped.conditions[str(condition)]
        assert tuple(by_clip) == load_scenario(condition.scenario).motion.test
        for found in by_clip.values():
            assert (SILENT_ANGLE in found.by_metric) == bool(condition.silent)
            assert {len(values) for values in found.by_metric.values()} == {len(condition.seeds(SEEDS))}


def test_the_shipped_errors_of_seed_1_are_those_of_the_issue() -> None:
    """The second column of issue 15, which has two decimals."""
    first = read_errors(ROOT / clip_errors.DEFAULT_BASELINE).first_seeds(SEEDS[:1])
    found = [result.more["stored_deg"] for result in evaluate_targets(first, first)]
    expected = [1.21, 1.67, 1.94, 2.61, 3.39, 3.28, 0.83, 1.53, 2.29, 2.84, 1.52, 2.45, 2.72, 3.23, 3.35, 2.60]
    assert found == pytest.approx(expected, abs=0.007)
