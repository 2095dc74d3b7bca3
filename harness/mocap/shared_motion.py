"""Motion that two clips share, found by content: a copy that is trimmed, shifted, resampled, mirrored or renamed.

A pose is described by the cosines between limbs and by how far each limb points upwards. These numbers do not change
with position, heading or body size, and mirroring permutes them. Each pose of one clip is compared with the nearest
pose of the other clip, at any time, so the rates and speeds of the clips do not matter.

Two clips share motion if the poses of one second differ by less than `SAME_MOTION` and move by at least `LEAST_MOTION`.
Different takes differ by more wherever they move. People who stand do not, hence the second condition.
"""

from collections.abc import Sequence
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from harness.core.arrays import Bools, Floats, Ints, Singles, find_runs
from harness.core.motion import Clip
from harness.mocap.limb_directions import MIRRORED, UPPER_BODY, limb_directions
from harness.mocap.motion_correlation import EVERY, GRID_HZ, FirstClip, Match, best_match, changes

SAME_MOTION = 0.004
"""Largest root mean square difference of descriptions over one second of the same motion."""
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
        for comparison in compare_poses(first, first_runs, second, second_runs)
        if (stretch := comparison.longest_stretch(first, second)) is not None
    ]
    if stretches:
        return max(stretches, key=lambda stretch: stretch.second_s[1] - stretch.second_s[0])
    match = best_match_of_clips(first, first_runs, second, second_runs, 1.0)
    if match is None:
        return None
    first_s, second_s = ((begin_s, begin_s + match.length_s) for begin_s in (match.first_s, match.second_s))
    return SharedMotion(first_s, second_s, match.mirrored)


def best_match_of_clips(
    first: Clip, first_runs: Sequence[range], second: Clip, second_runs: Sequence[range], limit: float
) -> Match | None:
    """The best match of changes whose share is below a limit, or None."""
    known, other = _first_clip(first), _describe_samples(second).changes
    moments = np.arange(other.shape[1]) * EVERY / GRID_HZ * second.rate_hz
    allowed = _lie_in_runs(moments, second_runs)
    grid = [
        range(*(min(round(frame / first.rate_hz * GRID_HZ), len(known.changes)) for frame in (run.start, run.stop)))
        for run in first_runs
    ]
    return min((match for run in grid if (match := best_match(known, run, other, allowed, limit))), default=None)


def _lie_in_runs(frames: Floats | Ints, runs: Sequence[range]) -> Bools:
    """(N,) whether frames (N,), which may lie between two whole ones, are in a run."""
    inside = [(frames >= run.start) & (frames < run.stop) for run in runs]
    out: Bools = np.any([np.zeros(len(frames), bool), *inside], axis=0)
    return out


class PoseComparison(NamedTuple):
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
        runs = find_runs(self.moving & (self.difference < SAME_MOTION))
        if not len(runs):
            return None
        begin, end = runs[np.argmax(runs[:, 1] - runs[:, 0])]
        poses = slice(begin, end + len(self.second_rows) - len(self.difference))
        times_s = self.first_rows[poses] / first.rate_hz, self.second_rows[poses] / second.rate_hz
        first_s, second_s = ((float(t.min()), float(t.max())) for t in times_s)
        return SharedMotion(first_s, second_s, self.mirrored)


def compare_poses(
    first: Clip, first_runs: Sequence[range], second: Clip, second_runs: Sequence[range]
) -> list[PoseComparison]:
    """Comparisons of two clips by run of the first one, as recorded and mirrored, where any two poses are close."""
    rows, samples, _ = _describe_samples(second)
    allowed = _lie_in_runs(rows, second_runs)
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
            out.append(PoseComparison(difference, moving, run.start + nearest, rows, mirrored))
    return out


def _nearest(poses: Singles, path: Singles) -> tuple[Ints, Floats]:
    """(N,) the row of a path (T, D) that is nearest to each pose (N, D), and their root mean square difference."""
    squared = np.sum(path**2, axis=1) - 2.0 * (poses @ path.T)
    nearest = np.argmin(squared, axis=1)
    least = squared[np.arange(len(poses)), nearest] + np.sum(poses**2, axis=1)
    return nearest, np.sqrt(np.maximum(least, 0.0) / poses.shape[1])


def _squared_distance_to_path(poses: Singles, path: Singles, nearest: Ints) -> Floats:
    """(N,) mean squared difference of poses to the two segments of a path that meet in the nearest row."""
    least = np.full(len(poses), np.inf)
    for other in (np.maximum(nearest - 1, 0), np.minimum(nearest + 1, len(path) - 1)):
        from_nearest, along = poses - path[nearest], path[other] - path[nearest]
        share = np.sum(from_nearest * along, axis=1) / np.maximum(np.sum(along**2, axis=1), 1e-12)
        rest = from_nearest - np.clip(share, 0.0, 1.0)[:, None] * along
        least = np.minimum(least, np.mean(rest**2, axis=1))
    return least


def _window_mean(values: Floats | Singles | Bools, window: int) -> Floats:
    """(N - window + 1, ...) means of values (N, ...) over each window."""
    sums = np.cumsum(np.concatenate([np.zeros((1, *values.shape[1:])), values]), axis=0)
    out: Floats = (sums[window:] - sums[:-window]) / window
    return out


def _window_spread(samples: Singles, window: int) -> Floats:
    """(N - window + 1,) root mean square deviation of descriptions (N, D) in each window from their mean."""
    variance = _window_mean(samples**2, window) - _window_mean(samples, window) ** 2
    out: Floats = np.sqrt(np.maximum(np.mean(variance, axis=1), 0.0))
    return out


_frame_cache: WeakKeyDictionary[Clip, Singles] = WeakKeyDictionary()
_first_cache: WeakKeyDictionary[Clip, FirstClip] = WeakKeyDictionary()
_sample_cache: WeakKeyDictionary[Clip, "_Samples"] = WeakKeyDictionary()


class _Samples(NamedTuple):
    """What is kept of a second clip."""

    frames: Ints
    """(N,) the frames of ten poses per second."""
    descriptions: Singles
    """(N, 55) their descriptions."""
    changes: Singles
    """(2, M, 2, 55) the changes at ten moments per second, as recorded and mirrored."""


def _describe_frames(clip: Clip) -> Singles:
    """(T, 55) descriptions of all frames of a first clip; cached."""
    if clip not in _frame_cache:
        _frame_cache[clip] = _describe(clip)
    return _frame_cache[clip]


def _first_clip(clip: Clip) -> FirstClip:
    """The changes of a first clip at all moments of the grid; cached."""
    if clip not in _first_cache:
        _first_cache[clip] = FirstClip(changes(_describe_frames(clip), clip.rate_hz), _UPPER_COLUMNS)
    return _first_cache[clip]


def _describe_samples(clip: Clip) -> _Samples:
    """What is compared of a second clip; cached. Its other frames are not kept, because there can be many clips."""
    if clip not in _sample_cache:
        descriptions = _describe(clip)
        rows = np.round(np.arange(0.0, len(clip), clip.rate_hz / _RATE_HZ)).astype(int)
        rows = rows[rows < len(clip)]
        sampled = changes(descriptions, clip.rate_hz)[::EVERY]
        both = np.stack([sampled, sampled[..., _MIRRORED_COLUMNS]])
        _sample_cache[clip] = _Samples(rows, descriptions[rows], both)
    return _sample_cache[clip]


def _describe(clip: Clip) -> Singles:
    """(T, 55) cosines between all limbs, and upward components of the limbs' directions, by frame."""
    directions = limb_directions(clip, np.arange(len(clip)))
    cosines = directions @ directions.transpose(0, 2, 1)
    out: Singles = np.concatenate([cosines[:, *_PAIRS], directions[:, :, 2]], axis=1).astype(np.float32)
    return out
