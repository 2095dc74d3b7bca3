"""Rankings agree with `compare_results` on the same values, and never lead where it cannot tell."""

import numpy as np
import pytest

from harness.compare.comparison import compare_results
from harness.compare.ranking import ClipValues, MethodRanking, find_best, rank_methods, split_by_lag
from harness.compare.units import Sampling
from harness.core.seeds import generator
from harness.results import PRIMARY_METRIC, ResultSet
from tests.compare.sides import side

METRICS = (PRIMARY_METRIC, "mpjpe_mm", "jitter_m_s3")


def values_of(results: ResultSet) -> dict[str, ClipValues]:
    found: dict[str, dict[str, dict[str, float]]] = {}
    for cell in results.cells:
        for metric in METRICS:
            value = cell.metrics[metric]
            assert value is not None
            found.setdefault(cell.method, {}).setdefault(metric, {})[cell.clip] = value
    return dict(found)


def rank(results: ResultSet, metric: str = PRIMARY_METRIC) -> MethodRanking:
    ranking = rank_methods(values_of(results), metric)
    assert ranking is not None
    return ranking


def test_differences_are_those_of_the_means() -> None:
    ranking = rank(scattered(1, 8))
    means = ranking.means
    assert list(ranking.differences) == list(ranking.results)
    for name, difference in ranking.differences.items():
        assert difference == pytest.approx(means[name] - means[ranking.lowest])
        result = ranking.results[name]
        assert result.low is not None
        assert result.high is not None
        assert result.low <= -difference <= result.high


def test_simultaneous_intervals_allow_for_all_lines_of_the_test() -> None:
    """Every one contains the interval of its difference alone; none is of units too few to be tested."""
    ranking = rank(scattered(2, 12))
    assert list(ranking.simultaneous) == list(ranking.results)
    for name, (low, high) in ranking.simultaneous.items():
        alone = ranking.results[name]
        assert alone.low is not None
        assert alone.high is not None
        assert low < -alone.high < -alone.low < high
    assert rank(scattered(2, 5)).simultaneous == {}


def scattered(seed: int, clips: int) -> ResultSet:
    """Methods whose errors are 0.7 to 1.3 times as large, with scatter over clips."""
    rng = generator(seed, "ranking")
    spread = 10.0 ** rng.uniform(-3.0, -1.0)
    methods = {f"m{n}": list(rng.uniform(0.7, 1.3) * np.exp(spread * rng.normal(size=clips))) for n in range(4)}
    return side(methods=methods, clips=clips)


@pytest.mark.parametrize("clips", [1, 3, 5, 6, 8, 12])
def test_a_ranking_says_no_more_than_the_comparison_of_two(clips: int) -> None:
    verdicts = set()
    for seed in range(6):
        results = scattered(seed, clips)
        ranking = rank(results)
        for name, result in ranking.results.items():
            for methods, word in (((name, ranking.lowest), "better"), ((ranking.lowest, name), "worse")):
                lines = compare_results(results, results, methods=methods).differences
                (line,) = (line for line in lines if line.metric == PRIMARY_METRIC)
                if result.verdict == "better":
                    assert line.verdict == word
                if line.verdict == "cannot tell":
                    assert result.verdict not in ("better", "worse")
                if methods[0] == name and "same" in (line.verdict, result.verdict):
                    assert line.verdict == result.verdict
                    assert (line.low, line.high) == (result.low, result.high)
            verdicts.add(result.verdict)
        assert find_best(values_of(results), PRIMARY_METRIC) == ranking.best
    assert ("better" in verdicts) == (clips == 12), "9 lines need 9 * 2 / 2^n of at most 0.05"


@pytest.mark.parametrize("clips", [1, 2, 5])
def test_few_clips_have_no_best_method_however_large_the_difference(clips: int) -> None:
    results = side(methods={"good": 1.0, "poor": 30.0}, clips=clips)
    assert (rank(results).lowest, rank(results).best) == ("good", None)
    assert rank(results).others("cannot tell") == ["poor"]
    assert find_best(values_of(results), PRIMARY_METRIC) is None


def test_a_clear_lead_on_many_clips_is_best() -> None:
    results = side(methods={"poor": 2.0, "good": 1.0, "worst": 3.0}, clips=10)
    assert list(rank(results).means) == ["good", "poor", "worst"]
    assert rank(results).best == find_best(values_of(results), PRIMARY_METRIC) == "good"


def test_equal_methods_are_the_same_on_any_number_of_clips() -> None:
    for clips in (1, 5, 8):
        ranking = rank(side(methods={"one": 1.0, "other": 1.0}, clips=clips))
        assert (ranking.best, ranking.others("same")) == (None, ["other"])


def test_more_methods_need_more_clips() -> None:
    """Two methods: 3 lines at p = 2/2^8. Twelve methods: 33 lines, and 33 * 2/2^8 is above 0.05."""
    few = side(methods={f"m{n:02}": 1.0 + n for n in range(2)}, clips=8)
    many = side(methods={f"m{n:02}": 1.0 + n for n in range(12)}, clips=8)
    assert (rank(few).best, rank(many).best) == ("m00", None)


def test_methods_on_other_clips_are_not_ranked() -> None:
    values: dict[str, ClipValues] = {"a": {PRIMARY_METRIC: {"x": 1.0}}, "b": {PRIMARY_METRIC: {"y": 1.0}}}
    assert rank_methods(values, PRIMARY_METRIC) is None
    assert rank_methods({}, PRIMARY_METRIC) is None
    assert find_best(values, PRIMARY_METRIC) is None
    alone = rank_methods({"a": {PRIMARY_METRIC: {"x": 1.0}}}, PRIMARY_METRIC)
    assert alone is not None
    assert (alone.lowest, alone.best, alone.results) == ("a", None, {})


def test_each_lag_is_a_part_of_its_own() -> None:
    values: dict[str, ClipValues] = {name: {PRIMARY_METRIC: {"x": 1.0}} for name in ("a", "late", "b", "later", "also")}
    parts = split_by_lag(values, {"late": 2, "later": 4, "also": 2, "a": 0})
    assert [(lag, list(part)) for lag, part in parts.items()] == [
        (0, ["a", "b"]),
        (2, ["late", "also"]),
        (4, ["later"]),
    ]
    assert split_by_lag({}, {}) == {}


def test_clips_of_one_performer_are_one_unit() -> None:
    """Twelve clips of three performers: what looks significant over clips is too few over performers."""
    clips = [f"walking_p{p}_0{take}" for p in (1, 2, 3) for take in (1, 2, 3, 4)]
    values: dict[str, ClipValues] = {
        "a": {PRIMARY_METRIC: dict.fromkeys(clips, 1.0)},
        "b": {PRIMARY_METRIC: {clip: 2.0 + 0.01 * n for n, clip in enumerate(clips)}},
    }
    ranking = rank_methods(values, PRIMARY_METRIC)
    assert ranking is not None
    assert ranking.units == ("performer p1", "performer p2", "performer p3")
    assert len(ranking.clips) == 12
    assert ranking.results["b"].why == "too few units: 3, of at least 6"
    np.testing.assert_allclose(ranking.values["b"], [2.015, 2.055, 2.095])
    each_its_own = Sampling(unit="clip")
    apart = rank_methods(values, PRIMARY_METRIC, each_its_own)
    assert apart is not None
    assert (len(apart.units), apart.best) == (12, "a")
    assert find_best(values, PRIMARY_METRIC) is None
    assert find_best(values, PRIMARY_METRIC, each_its_own) == "a"
