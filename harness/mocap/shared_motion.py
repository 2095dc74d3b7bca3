"""Motion that two clips share, found by content: a copy that is trimmed, shifted, resampled, mirrored or renamed.

A pose is described by the cosines between limbs and by how far each limb points upwards. These numbers do not change
with position, heading or body size, and mirroring permutes them. Each pose of one clip is compared with the nearest
pose of the other clip, at any time, so the rates and speeds of the clips do not matter.

Two clips share motion if the poses of one second differ by less than `SAME_MOTION` and move by at least `LEAST_MOTION`.
Different takes differ by more wherever they move. People who stand do not, hence the second condition.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from harness.core.arrays import Bools, Floats, Ints
from harness.core.motion import Clip
from harness.mocap.limb_directions import MIRRORED, UPPER_BODY, limb_directions
from harness.mocap.motion_correlation import GRID_HZ, Match, best_match, changes

SAME_MOTION = 0.004
"""Largest root mean square difference of descriptions over one second of the same motion (see `least_difference`)."""
LEAST_MOTION = 0.06
"""Least root mean square deviation of the descriptions of one second from their mean; people at rest stay below it."""
_RATE_HZ, _WINDOW, _LEAST_WINDOW = 10.0, 10, 5
"""Poses per second that are compared, and number of poses that are compared together; a clip may have fewer."""
_COARSE_DIFFERENCE = 0.04
"""One pose of each window is compared first, with every second frame. A copy differs by less, even between frames."""
_PAIRS = np.triu_indices(len(MIRRORED), 1)
_PAIR_NUMBER = {frozenset(pair): number for number, pair in enumerate(zip(*(i.tolist() for i in _PAIRS), strict=True))}
_MIRRORED_COLUMNS = np.array(
    [
        *(_PAIR_NUMBER[frozenset(MIRRORED[list(pair)].tolist())] for pair in _PAIR_NUMBER),
        *(len(_PAIR_NUMBER) + MIRRORED),
    ]
)
_UPPER_PAIRS: Bools = np.asarray(np.isin(_PAIRS, UPPER_BODY).all(axis=0))
_UPPER_COLUMNS = np.append(np.flatnonzero(_UPPER_PAIRS), len(_UPPER_PAIRS) + UPPER_BODY)
"""Columns of the descriptions that the legs do not change."""


class SharedMotion(NamedTuple):
    """The longest stretch of motion that two clips share, in the time of each clip [s]."""

    first_s: tuple[float, float]
    second_s: tuple[float, float]
    mirrored: bool
    """Whether left and right have changed places."""


def find_shared_motion(
    first: Clip, first_runs: Sequence[range], second: Clip, second_runs: Sequence[range]
) -> SharedMotion | None:
    """The longest stretch that runs of frames of two clips share; None if they share no moving one.

    Where no stretch has the same poses, it is the stretch whose changes correlate best (see
    `motion_correlation`).
    """
    stretches = [
        stretch
        for comparison in _compare(first, first_runs, second, second_runs)
        if (stretch := comparison.longest_stretch(first, second)) is not None
    ]
    longest = max(stretches, key=lambda stretch: stretch.second_s[1] - stretch.second_s[0], default=None)
    return longest or _find_edited_motion(first, first_runs, second, second_runs)


def _find_edited_motion(
    first: Clip, first_runs: Sequence[range], second: Clip, second_runs: Sequence[range]
) -> SharedMotion | None:
    """The stretch of the best match of changes, if it is one of the same motion."""
    found = [(match, begin_s, mirrored) for match, begin_s, mirrored in _match(first, first_runs, second, second_runs)]
    match, begin_s, mirrored = min(found, default=(None, 0.0, False))
    if match is None or match.share >= 1.0:
        return None
    first_s, second_s = begin_s + match.first_s, match.second_s
    return SharedMotion((first_s, first_s + match.length_s), (second_s, second_s + match.length_s), mirrored)


def least_loss(first: Clip, first_runs: Sequence[range], second: Clip, second_runs: Sequence[range]) -> float:
    """Least loss of correlation of two clips, relative to the largest one of a copy; inf where nothing moves."""
    return min((match.share for match, *_ in _match(first, first_runs, second, second_runs)), default=np.inf)


def _match(
    first: Clip, first_runs: Sequence[range], second: Clip, second_runs: Sequence[range]
) -> Iterator[tuple[Match, float, bool]]:
    """The best match of each run of the first clip, when the run begins [s], and whether it is mirrored."""
    other = _changes(second)
    moments = np.arange(len(other)) / GRID_HZ * second.rate_hz
    allowed = np.zeros(len(other), bool)
    for run in second_runs:
        allowed |= (moments >= run.start) & (moments < run.stop)
    if not allowed.any():
        return
    for run in first_runs:
        begin, end = (round(frame / first.rate_hz * GRID_HZ) for frame in (run.start, run.stop))
        own = _changes(first)[begin:end]
        for mirrored in (False, True):
            columns = other[:, :, _MIRRORED_COLUMNS] if mirrored else other
            match = best_match(own, columns, allowed, _UPPER_COLUMNS)
            if match is not None:
                yield match, begin / GRID_HZ, mirrored


def least_difference(first: Clip, first_runs: Sequence[range], second: Clip, second_runs: Sequence[range]) -> float:
    """Least difference of two clips over a second that moves, as `SAME_MOTION` bounds it; inf if it is large."""
    comparisons = _compare(first, first_runs, second, second_runs)
    return min((float(c.difference[c.moving].min(initial=np.inf)) for c in comparisons), default=np.inf)


class _Comparison(NamedTuple):
    """Windows of the second clip, compared with a run of the first one."""

    difference: Floats
    """(W,) root mean square difference of each window of ten poses to the nearest poses of the first clip."""
    moving: Bools
    """(W,) whether the window moves enough."""
    first_rows: Ints
    """(N,) the frame of the first clip that is nearest to each pose."""
    second_rows: Ints
    """(N,) the frames of the N poses."""
    mirrored: bool

    def longest_stretch(self, first: Clip, second: Clip) -> SharedMotion | None:
        """The longest stretch of windows of the same motion, or None."""
        same = np.concatenate([[False], self.moving & (self.difference < SAME_MOTION), [False]])
        begins, ends = np.flatnonzero(np.diff(same.astype(int)) == 1), np.flatnonzero(np.diff(same.astype(int)) == -1)
        if not len(begins):
            return None
        longest = int(np.argmax(ends - begins))
        window = len(self.second_rows) - len(self.difference) + 1
        poses = slice(begins[longest], ends[longest] - 1 + window)
        times_s = self.first_rows[poses] / first.rate_hz, self.second_rows[poses] / second.rate_hz
        first_s, second_s = ((float(t.min()), float(t.max())) for t in times_s)
        return SharedMotion(first_s, second_s, self.mirrored)


def _compare(first: Clip, first_runs: Sequence[range], second: Clip, second_runs: Sequence[range]) -> list[_Comparison]:
    """Comparisons of two clips by run of the first one, as recorded and mirrored, where any two poses are close."""
    rows, samples = _describe_samples(second)
    allowed = np.zeros(len(rows), bool)
    for run in second_runs:
        allowed |= (rows >= run.start) & (rows < run.stop)
    window = min(_WINDOW, len(rows))
    if window < _LEAST_WINDOW or not allowed.any():
        return []
    frames, out = _describe_frames(first), []
    coarse = samples[window // 2 :: window][allowed[window // 2 :: window]]
    for run in first_runs:
        path = frames[run.start : run.stop]
        for mirrored, columns in ((False, slice(None)), (True, _MIRRORED_COLUMNS)):
            if len(path) < 2 or _nearest(coarse[:, columns], path[::2])[1].min(initial=np.inf) > _COARSE_DIFFERENCE:
                continue
            poses = samples[:, columns]
            nearest, _ = _nearest(poses, path)
            difference = np.sqrt(_window_mean(_squared_distance_to_path(poses, path, nearest), window))
            moving = (_window_spread(samples, window) >= LEAST_MOTION) & (_window_mean(allowed, window) > 1.0 - 1e-9)
            out.append(_Comparison(difference, moving, run.start + nearest, rows, mirrored))
    return out


def _nearest(poses: Floats, path: Floats) -> tuple[Ints, Floats]:
    """(N,) the row of a path (T, D) that is nearest to each pose (N, D), and their root mean square difference."""
    squared = np.sum(path**2, axis=1) - 2.0 * (poses @ path.T)
    nearest = np.argmin(squared, axis=1)
    least = squared[np.arange(len(poses)), nearest] + np.sum(poses**2, axis=1)
    return nearest, np.sqrt(np.maximum(least, 0.0) / poses.shape[1])


def _squared_distance_to_path(poses: Floats, path: Floats, nearest: Ints) -> Floats:
    """(N,) mean squared difference of poses to the two segments of a path that meet in the nearest row."""
    least = np.full(len(poses), np.inf)
    for other in (np.maximum(nearest - 1, 0), np.minimum(nearest + 1, len(path) - 1)):
        from_nearest, along = poses - path[nearest], path[other] - path[nearest]
        share = np.sum(from_nearest * along, axis=1) / np.maximum(np.sum(along**2, axis=1), 1e-12)
        rest = from_nearest - np.clip(share, 0.0, 1.0)[:, None] * along
        least = np.minimum(least, np.mean(rest**2, axis=1))
    return least


def _window_mean(values: Floats | Bools, window: int) -> Floats:
    """(N - window + 1, ...) means of values (N, ...) over each window."""
    sums = np.cumsum(np.concatenate([np.zeros((1, *values.shape[1:])), values]), axis=0)
    out: Floats = (sums[window:] - sums[:-window]) / window
    return out


def _window_spread(samples: Floats, window: int) -> Floats:
    """(N - window + 1,) root mean square deviation of descriptions (N, D) in each window from their mean."""
    variance = _window_mean(samples**2, window) - _window_mean(samples, window) ** 2
    out: Floats = np.sqrt(np.maximum(np.mean(variance, axis=1), 0.0))
    return out


_frame_cache: WeakKeyDictionary[Clip, Floats] = WeakKeyDictionary()
_change_cache: WeakKeyDictionary[Clip, Floats] = WeakKeyDictionary()
_sample_cache: WeakKeyDictionary[Clip, tuple[Ints, Floats]] = WeakKeyDictionary()


def _describe_frames(clip: Clip) -> Floats:
    """(T, 55) descriptions of all frames of a clip; cached."""
    if clip not in _frame_cache:
        _frame_cache[clip] = _describe(clip, np.arange(len(clip)))
    return _frame_cache[clip]


def _changes(clip: Clip) -> Floats:
    """(N, 2, 55) speeds and accelerations of the descriptions of a clip at the moments of the grid; cached."""
    if clip not in _change_cache:
        _change_cache[clip] = changes(_describe_frames(clip), clip.rate_hz)
    return _change_cache[clip]


def _describe_samples(clip: Clip) -> tuple[Ints, Floats]:
    """The frames (N,) of ten poses per second of a clip, and their descriptions (N, 55); cached."""
    if clip not in _sample_cache:
        rows = np.round(np.arange(0.0, len(clip), clip.rate_hz / _RATE_HZ)).astype(int)
        rows = rows[rows < len(clip)]
        _sample_cache[clip] = rows, _describe(clip, rows)
    return _sample_cache[clip]


def _describe(clip: Clip, rows: Ints) -> Floats:
    """(N, 55) cosines between all limbs, and upward components of the limbs' directions, in these frames."""
    directions = limb_directions(clip, rows)
    cosines = directions @ directions.transpose(0, 2, 1)
    out: Floats = np.concatenate([cosines[:, *_PAIRS], directions[:, :, 2]], axis=1).astype(np.float32)
    return out
