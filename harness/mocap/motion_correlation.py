"""Correlation of how the descriptions of two clips change: it finds copies that were edited in every frame.

An edited copy no longer has the poses of the clip, but it still speeds up and slows down with it. The descriptions of
`shared_motion` are differentiated once and twice, which takes drift and offsets away, and the changes in a window of
one clip are correlated with those of the other clip at every lag. Amplitude does not matter. The upper body is also
compared alone, because the legs may have been replaced. Different takes correlate less, also those of one walker: the
longer the window, the less. So a long window finds larger edits than a short one.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from harness.core.arrays import Bools, Floats, Ints

GRID_HZ, EVERY = 100, 10
"""Moments per second at which the first clip is known; every tenth moment of the second one is compared."""
_HALF_SPAN, _MEAN_OF = 5, 5
"""Differences are of means over five moments, which are this many moments apart (twice for the first derivative)."""


class Part(NamedTuple):
    """What is compared: the whole body or the upper body, by speed or by acceleration."""

    upper_body: bool
    acceleration: bool

    @property
    def least_change(self) -> float:
        """Least root mean square change in a window; people at rest stay below it [choice]."""
        return 0.01 if self.acceleration else 0.03


class Window(NamedTuple):
    """A length of windows of a part, and the limit between copies and different takes."""

    part: Part
    samples: int
    """Length [0.1 s]."""
    largest_loss: float
    """Loss of correlation (1 - r) below which the motion is the same."""


_SPEED, _ACCELERATION = Part(False, False), Part(False, True)
_UPPER_SPEED, _UPPER_ACCELERATION = Part(True, False), Part(True, True)
WINDOWS = (
    Window(_SPEED, 6, 0.0005),
    Window(_SPEED, 16, 0.0008),
    Window(_UPPER_SPEED, 16, 0.0005),
    Window(_ACCELERATION, 16, 0.0015),
    Window(_ACCELERATION, 30, 0.0055),
    Window(_UPPER_ACCELERATION, 16, 0.00075),
    Window(_UPPER_ACCELERATION, 30, 0.0015),
)
"""Limits: at most 0.6 of the least loss between different takes of one performer and behaviour, and between a fifth of
a take and the rest of it. The nearest are swings of golf and walks of the motion generator."""


class Match(NamedTuple):
    """The windows of two clips that correlate best."""

    share: float
    """Loss of correlation relative to `Window.largest_loss`; below 1 the motion is the same."""
    first_s: float
    second_s: float
    """Beginning of the window in each clip [s]."""
    length_s: float


def changes(descriptions: Floats, rate_hz: float) -> Floats:
    """(N, 2, D) speeds and accelerations of descriptions (T, D) at the moments of the grid; the ends are repeated."""
    moments = np.arange(0.0, (len(descriptions) - 1) / rate_hz + 1e-9, 1.0 / GRID_HZ) * rate_hz
    row = np.minimum(moments.astype(int), max(len(descriptions) - 2, 0))
    beside = (moments - row)[:, None].astype(np.float32)
    at = descriptions[row] * (1.0 - beside) + descriptions[np.minimum(row + 1, len(descriptions) - 1)] * beside
    ends = _HALF_SPAN + _MEAN_OF // 2
    padded = np.concatenate([at[:1].repeat(ends, 0), at, at[-1:].repeat(ends, 0)])
    count = len(padded) - _MEAN_OF + 1
    smooth = sum((padded[k : k + count] for k in range(1, _MEAN_OF)), start=padded[:count]) / np.float32(_MEAN_OF)
    before, now, after = smooth[: -2 * _HALF_SPAN], smooth[_HALF_SPAN:-_HALF_SPAN], smooth[2 * _HALF_SPAN :]
    return np.stack([after - before, after - 2.0 * now + before], axis=1)


def best_match(first: Floats, second: Floats, allowed: Bools, upper_body: Ints) -> Match | None:
    """The best match of windows of the changes of two clips (N, 2, D) and (M, 2, D); None where nothing moves enough.

    `allowed` (M,) has the moments of the second clip that count, `upper_body` the columns of the upper body.
    """
    sampled, kept = second[::EVERY], allowed[::EVERY]
    found = list[Match]()
    for part in dict.fromkeys(window.part for window in WINDOWS):
        a, b = (x[:, int(part.acceleration)] for x in (first, sampled))
        if part.upper_body:
            a, b = a[:, upper_body], b[:, upper_body]
        found += _matches(a, b, kept, [window for window in WINDOWS if window.part == part])
    return min(found, default=None)


def _matches(first: Floats, second: Floats, allowed: Bools, windows: Sequence[Window]) -> Iterator[Match]:
    """The best match of each length of windows of one part."""
    products = second @ first.T
    powers = np.sum(second**2, axis=1), np.sum(first**2, axis=1)
    for part, size, largest_loss in windows:
        if len(second) < size or len(first) <= (size - 1) * EVERY:
            continue
        energy, other = _window_sums(powers[0], size, 1), _window_sums(powers[1], size, EVERY)
        complete = _window_sums(allowed.astype(float), size, 1) > size - 0.5
        least = part.least_change**2 * size * first.shape[1]
        rows, columns = complete & (energy > least), other > 0.5 * least
        if not rows.any() or not columns.any():
            continue
        correlation = _diagonal_sums(products, size) * (columns / np.sqrt(np.maximum(other, 1e-12)))
        correlation *= (rows / np.sqrt(np.maximum(energy, 1e-12)))[:, None]
        row, column = np.unravel_index(int(np.argmax(correlation)), correlation.shape)
        loss = 1.0 - float(correlation[row, column])
        yield Match(loss / largest_loss, int(column) / GRID_HZ, int(row) * EVERY / GRID_HZ, size * EVERY / GRID_HZ)


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
