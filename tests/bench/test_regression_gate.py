"""The gate held to its figures: false alarms, changes found, coverage; a share of the studies here, all when slow."""

import numpy as np
import pytest

from harness.bench import regression_gate
from harness.bench.stored_errors import KINDS, METRICS, load_null_errors
from harness.compare import GATED_METRICS, decide_verdicts
from harness.core.arrays import Floats
from harness.core.seeds import generator


@pytest.fixture(scope="module")
def settings() -> Floats:
    return load_null_errors("settings")


@pytest.mark.parametrize("kind", KINDS)
def test_stored_errors_are_real_differences_of_many_clips(kind: str) -> None:
    people = load_null_errors(kind)
    assert people.shape[::3] == (5, 2)
    assert people.shape[1] == len(METRICS)
    assert people.shape[2] >= 24
    assert np.isfinite(people).all()
    assert (people > 0.0).all()
    assert (people[..., 0] != people[..., 1]).mean() > 0.95
    assert set(METRICS) <= set(GATED_METRICS)


@pytest.mark.parametrize("draw", [regression_gate.exchanged, regression_gate.heavy, regression_gate.centred])
def test_drawn_studies_hold_nothing(draw: regression_gate.Resampler, settings: Floats) -> None:
    """Over many draws no side is better in any line."""
    rng = generator(1, "many")
    means = []
    for _ in range(400):
        errors = draw(settings, 24, rng)
        means.append((errors[..., 1] - errors[..., 0]).mean(axis=2))
    mean, sd = np.mean(means, axis=0), np.std(means, axis=0)
    assert (np.abs(mean) < 5.0 * sd / np.sqrt(400)).all()


def test_an_exchange_keeps_what_metrics_of_a_clip_share(settings: Floats) -> None:
    stored = {tuple(sorted(map(float, pair))) for pair in settings[0, 0]}
    errors = regression_gate.exchanged(settings, 200, generator(1, "one"))
    assert {tuple(sorted(map(float, pair))) for pair in errors[0, 0]} <= stored
    both = settings[0]
    for n in range(200):
        (at,) = [
            c for c in range(both.shape[1]) if (np.sort(both[:, c], axis=1) == np.sort(errors[0, :, n], axis=1)).all()
        ]
        kept, turned = both[:, at], both[:, at, ::-1]
        assert (errors[0, :, n] == kept).all() or (errors[0, :, n] == turned).all()


def test_worse_is_what_a_comparison_calls_worse(settings: Floats) -> None:
    """Studies skip intervals that cannot matter; verdicts stay those of the gate."""
    seen = 0
    for n in range(4):
        errors = regression_gate.exchanged(settings, 12, generator(1, "both ways", n))[:2]
        errors[n % 2, :, :, 1] *= 1.0 + 0.03 * n
        verdicts, worse = decide_verdicts(*regression_gate.compared_lines(errors)), regression_gate.called_worse(errors)
        assert [result.verdict == "worse" for result in verdicts] == worse.tolist()
        seen += int(worse.sum())
    assert seen >= 4


def test_most_lines_of_equally_good_sides_are_told_the_same(settings: Floats) -> None:
    assert 0.8 <= regression_gate.share_called_same(settings, 24, 3, 1) <= 1.0


@pytest.mark.parametrize(("count", "of", "most"), [(0, 1000, 0.00299), (25, 1000, 0.0349), (50, 50, 1.0)])
def test_rates_are_bounded_as_printed_tables_have_it(count: int, of: int, most: float) -> None:
    assert regression_gate.upper_confidence_rate(count, of) == pytest.approx(most, rel=0.01)
    assert regression_gate.lower_confidence_rate(of - count, of) == pytest.approx(1.0 - most, abs=1e-3)


def false_alarms(
    people: Floats, studies: int, clips: int = 24, draw: regression_gate.Resampler = regression_gate.exchanged
) -> int:
    return regression_gate.count_false_alarms(people, clips, studies, 1, draw)


def test_few_of_the_studies_alarm_falsely(settings: Floats) -> None:
    assert false_alarms(settings, 40) <= 2


def test_most_changes_of_3_percent_are_found(settings: Floats) -> None:
    assert regression_gate.detect_changes(settings, 24, 20, 1).mean() >= 0.9
    assert not regression_gate.detect_changes(settings, 24, 6, 1, change=0.0).any()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("clips", "draw"),
    [
        (24, regression_gate.exchanged),
        (12, regression_gate.exchanged),
        (8, regression_gate.exchanged),
        (24, regression_gate.heavy),
        (24, regression_gate.centred),
    ],
)
def test_false_alarms_stay_below_5_percent(clips: int, draw: regression_gate.Resampler, settings: Floats) -> None:
    count = false_alarms(settings, regression_gate.COMPARISONS, clips, draw)
    print(f"{draw.__name__}, {clips} clips: {count} of {regression_gate.COMPARISONS}")
    assert regression_gate.upper_confidence_rate(count, regression_gate.COMPARISONS) <= 0.05


@pytest.mark.slow
def test_a_change_of_3_percent_is_found_in_9_of_10_studies(settings: Floats) -> None:
    assert regression_gate.detect_changes(settings, 24, regression_gate.CHANGED_COMPARISONS, 1).mean() >= 0.9
