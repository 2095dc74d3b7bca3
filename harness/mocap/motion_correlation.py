"""Correlation of the accelerations of two clips: it finds copies that were changed in every frame, or in some limbs.

An edited copy no longer has the poses of the clip, but it still speeds up and slows down with it. The descriptions of
`shared_motion` are differentiated twice, which takes drift and offsets away, and the accelerations in a window of one
clip are correlated with those of the other clip at every lag. Amplitude does not matter. The upper body is also
compared alone, because the legs may have been replaced. Different takes correlate less, also those of one walker: the
longer the window, the less. So a long window finds larger changes than a short one.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from harness.core.arrays import Bools, Floats, Ints

GRID_HZ, EVERY = 100, 10
"""Moments per second at which the first clip is known; every tenth moment of the second one is compared."""
_HALF_SPAN, _MEAN_OF = 5, 5
"""Accelerations are second differences of means over five moments, which are this many moments apart."""
LEAST_ACCELERATION = 0.01
"""Least root mean square acceleration in a window [change of the descriptions in 0.05 s, squared]; people at rest stay
below it."""


class Window(NamedTuple):
    """A length of windows, the part of the body that is compared, and the limit between copies and different takes."""

    samples: int
    """Length [0.1 s]."""
    part: int
    """Number of the part: 0 is the whole body, 1 the upper body."""
    largest_loss: float
    """Loss of correlation (1 - r) below which the motion is the same."""


WINDOWS = (
    Window(6, 0, 0.0018),
    Window(16, 0, 0.0060),
    Window(30, 0, 0.0135),
    Window(6, 1, 0.0016),
    Window(16, 1, 0.0034),
    Window(30, 1, 0.0054),
)


class Match(NamedTuple):
    """The windows of two clips that correlate best."""

    share: float
    """Loss of correlation relative to `Window.largest_loss`; below 1 the motion is the same."""
    first_s: float
    second_s: float
    """Beginning of the window in each clip [s]."""
    length_s: float


def accelerations(descriptions: Floats, rate_hz: float) -> Floats:
    """(N, D) second differences of descriptions (T, D) at the moments of the grid; a clip's ends are repeated."""
    moments = np.arange(0.0, (len(descriptions) - 1) / rate_hz + 1e-9, 1.0 / GRID_HZ) * rate_hz
    row = np.minimum(moments.astype(int), max(len(descriptions) - 2, 0))
    beside = (moments - row)[:, None].astype(np.float32)
    at = descriptions[row] * (1.0 - beside) + descriptions[np.minimum(row + 1, len(descriptions) - 1)] * beside
    ends = _HALF_SPAN + _MEAN_OF // 2
    padded = np.concatenate([at[:1].repeat(ends, 0), at, at[-1:].repeat(ends, 0)])
    count = len(padded) - _MEAN_OF + 1
    smooth = sum((padded[k : k + count] for k in range(1, _MEAN_OF)), start=padded[:count]) / np.float32(_MEAN_OF)
    out: Floats = smooth[2 * _HALF_SPAN :] - 2.0 * smooth[_HALF_SPAN:-_HALF_SPAN] + smooth[: -2 * _HALF_SPAN]
    return out


def best_match(
    first: Floats, second: Floats, allowed: Bools, parts: Sequence[Ints], windows: Sequence[Window]
) -> Match | None:
    """The best match of windows of the accelerations of two clips (N, D) and (M, D); None where nothing moves enough.

    `allowed` (M,) has the moments of the second clip that count. `parts` has the columns of each part of the body.
    """
    sampled, kept = second[::EVERY], allowed[::EVERY]
    found = [
        match
        for number, columns in enumerate(parts)
        for match in _matches(first[:, columns], sampled[:, columns], kept, [w for w in windows if w.part == number])
    ]
    return min(found, default=None)


def _matches(first: Floats, second: Floats, allowed: Bools, windows: Sequence[Window]) -> Iterator[Match]:
    products = second @ first.T
    for window in windows:
        size = window.samples
        if len(second) < size or len(first) <= (size - 1) * EVERY:
            continue
        energy = _window_sums(np.sum(second**2, axis=1), size, 1)
        other = _window_sums(np.sum(first**2, axis=1), size, EVERY)
        whole = _window_sums(allowed.astype(float), size, 1) > size - 0.5
        least = LEAST_ACCELERATION**2 * size * first.shape[1]
        rows, columns = np.flatnonzero(whole & (energy > least)), np.flatnonzero(other > 0.5 * least)
        if not len(rows) or not len(columns):
            continue
        sums = _diagonal_sums(products, size)[np.ix_(rows, columns)]
        sums /= np.sqrt(energy[rows])[:, None]
        sums /= np.sqrt(other[columns])[None]
        row, column = np.unravel_index(int(np.argmax(sums)), sums.shape)
        loss = 1.0 - float(sums[row, column])
        begins_s = int(columns[column]) / GRID_HZ, int(rows[row]) * EVERY / GRID_HZ
        yield Match(loss / window.largest_loss, *begins_s, size * EVERY / GRID_HZ)


def _window_sums(values: Floats, size: int, step: int) -> Floats:
    """Sums of `size` values that are `step` apart, by the first of them."""
    count = max(len(values) - (size - 1) * step, 0)
    out: Floats = np.sum([values[k * step : k * step + count] for k in range(size)], axis=0)
    return out


def _diagonal_sums(products: Floats, size: int) -> Floats:
    """Sums of `size` products along the diagonals (one row and `EVERY` columns further), by the first of them.

    Sums of 1, 2, 4 ... products are made by doubling, and those that `size` is made of are added.
    """
    rows, columns = len(products) - size + 1, products.shape[1] - (size - 1) * EVERY
    total, done, power, run = np.zeros((rows, columns), products.dtype), 0, 1, products
    while power <= size:
        if size & power:
            total += run[done : done + rows, done * EVERY : done * EVERY + columns]
            done += power
        run = run[:-power, : -power * EVERY] + run[power:, power * EVERY :]
        power *= 2
    return total
