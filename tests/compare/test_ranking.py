"""Rankings agree with `compare_results` on the same values, and never lead where it cannot tell."""

import numpy as np
import pytest

from harness.compare.comparison import compare_results
from harness.compare.ranking import ClipValues, MethodRanking, find_best, rank_methods, split_by_lag
from harness.core.seeds import generator
from harness.report.kit.ranking import describe_ranking
from harness.results.reader import ResultSet
from harness.results.reported_metrics import PRIMARY_METRIC
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


@pytest.mark.parametrize(
    ("clips", "performers", "said"),
    [
        (("walking_p1_01", "boxing_p1_02@0.20-0.40", "walking_p2_01"), None, "2 performers"),
        (("13_17", "13_18@0.2-0.4"), None, "1 performer"),
        (("a: 13_17", "b: 14_01"), None, "2 performers"),
        (("take one", "13_17"), None, ""),
        (("13_17", "14_01"), {"13_17": "Anna", "14_01": "Anna"}, "1 performer"),
        (("a: take one@0.20-0.40", "a: two"), {"take one": "Anna", "two": "Bert"}, "2 performers"),
        (("walking_p1_01", "two"), {"two": "Bert"}, ""),
    ],
)
def test_a_ranking_states_its_performers(clips: tuple[str, ...], performers: dict[str, str] | None, said: str) -> None:
    values = {name: {"joint_angle_mean_deg": dict.fromkeys(clips, error)} for name, error in (("a", 1.0), ("b", 2.0))}
    ranking = rank_methods(values, "joint_angle_mean_deg")
    assert ranking is not None
    where = f"clips ({said})" if said else "clips"
    assert f", 1.0 on {where}, but" in describe_ranking(ranking, "clips", str, performers=performers)
