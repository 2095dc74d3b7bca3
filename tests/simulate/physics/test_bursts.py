"""Bursts of noise."""

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.simulate.physics.sound import Bursts


def test_number_and_duration_are_those_of_the_settings() -> None:
    bursts = Bursts(2.0, (0.05, 0.3), seed=1, take="t")
    intervals_s = bursts.intervals_s(-30_000.0, 30_000.0)
    assert len(intervals_s) == pytest.approx(2000, abs=4.0 * np.sqrt(2000))
    duration_s = np.diff(intervals_s, axis=1)
    assert duration_s.min() >= 0.05 - 1e-9
    assert duration_s.max() <= 0.3 + 1e-9
    assert duration_s.mean() == pytest.approx(0.175, abs=0.01)


def test_bursts_do_not_depend_on_when_the_simulation_begins() -> None:
    edges_s: Floats = 0.0125 * np.arange(-4000.0, 12_001.0)
    whole = Bursts(30.0, (0.05, 2.0), seed=1, take="t").touch(edges_s[:-1], edges_s[1:])
    assert 0.1 < whole[:4000].mean() < 0.9
    for first in (1, 3999, 4000, 9000):
        part = Bursts(30.0, (0.05, 2.0), seed=1, take="t").touch(edges_s[first:-1], edges_s[first + 1 :])
        np.testing.assert_array_equal(part, whole[first:])


def test_a_burst_touches_the_intervals_that_it_overlaps() -> None:
    bursts = Bursts(20.0, (0.5, 1.0), seed=3, take="t")
    begins_s, ends_s = bursts.intervals_s(0.0, 60.0)[0]
    edges_s = np.array([begins_s - 0.2, begins_s - 0.1, begins_s + 0.1, begins_s + 0.2])
    np.testing.assert_array_equal(bursts.touch(edges_s[:-1], edges_s[1:]), [False, True, True])
    assert bursts.touch(np.array([ends_s - 0.01]), np.array([ends_s + 5.0])).all()


def test_a_burst_goes_on_over_the_minute() -> None:
    bursts = Bursts(30.0, (0.5, 2.0), seed=3, take="t")
    over = [(b, e) for b, e in bursts.intervals_s(0.0, 3600.0) if b // 60.0 != e // 60.0]
    assert over
    for _, ends_s in over:
        begin_s = np.array([ends_s // 60.0 * 60.0])
        assert Bursts(30.0, (0.5, 2.0), seed=3, take="t").touch(begin_s, begin_s + 1e-6).all()


def test_takes_and_seeds_differ() -> None:
    first = Bursts(2.0, (0.05, 0.3), seed=1, take="t").intervals_s(0.0, 600.0)
    for other in (Bursts(2.0, (0.05, 0.3), seed=2, take="t"), Bursts(2.0, (0.05, 0.3), seed=1, take="u")):
        assert not np.array_equal(other.intervals_s(0.0, 600.0), first)


def test_no_bursts() -> None:
    edges_s = np.arange(0.0, 600.0, 0.0125)
    assert not Bursts(0.0, (0.05, 0.3), seed=1, take="t").touch(edges_s[:-1], edges_s[1:]).any()
