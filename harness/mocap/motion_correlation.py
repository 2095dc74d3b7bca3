"""Correlation of how the descriptions of two clips change: it finds copies that were edited in every frame.

An edited copy no longer has the poses of the clip, but it still speeds up and slows down with it. The descriptions of
`shared_motion` are differentiated once and twice, which takes drift and offsets away, and the changes in a window of
one clip are correlated with those of the other clip at every shift. Amplitude does not matter. The upper body is also
compared alone, because the legs may have been replaced. Different takes correlate less, also those of one walker: the
longer the window, the less. So a long window finds larger edits than a short one.

Few pairs of windows are correlated. A window, as a unit vector, is known by its components along a few orthonormal
directions and by the length of the rest. The product of the components of two windows plus that of their rests is at
least their correlation (inequality of Cauchy and Schwarz). Pairs whose bound is too low are no match.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from harness.core.arrays import Bools, Floats, Ints, Singles

GRID_HZ, EVERY = 100, 10
"""Moments per second at which the first clip is known; every tenth moment of the second one is compared."""
_HALF_SPAN, _MEAN_OF = 5, 5
"""Differences are of means over five moments, which are this many moments apart (twice for the first derivative)."""
_COMPONENTS, _MODES = 8, 8
"""The directions of a bound combine these principal components of the first clip in the lowest modes of the cosine
transform over the window."""
_ROUNDING = 1e-5
"""More than the error of a bound, which is computed in single precision."""
_TOGETHER, _BOUNDED = 256, 4_000_000
"""Pairs of windows that are correlated at a time, and that are bounded at a time (16 MB)."""


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
    directions: int
    """Number of directions of the bound; more take longer and leave fewer pairs [choice]."""


_SPEED, _ACCELERATION = Part(False, False), Part(False, True)
_UPPER_SPEED, _UPPER_ACCELERATION = Part(True, False), Part(True, True)
WINDOWS = (
    Window(_SPEED, 6, 0.0005, 6),
    Window(_SPEED, 16, 0.0008, 6),
    Window(_UPPER_SPEED, 16, 0.0005, 6),
    Window(_ACCELERATION, 16, 0.0015, 8),
    Window(_ACCELERATION, 30, 0.0055, 16),
    Window(_UPPER_ACCELERATION, 16, 0.00075, 6),
    Window(_UPPER_ACCELERATION, 30, 0.0015, 8),
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
    mirrored: bool
    """Whether left and right of the second clip have changed places."""


class _Bound(NamedTuple):
    """What bounds the correlation of the windows of a first clip with others."""

    components: Floats
    """(E, C) principal components of what is compared."""
    directions: Floats
    """(S, C, K) orthonormal directions, by samples of a window and their components."""
    energy: Floats
    """(W,) sums of squares of the windows of the first clip."""
    features: Singles
    """(W, K + 1) their components along the directions, and the lengths of the rests."""


def changes(descriptions: Singles, rate_hz: float) -> Singles:
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


@dataclass(frozen=True, eq=False)
class FirstClip:
    """The clip that others are compared with; its windows are described once."""

    changes: Singles
    """(N, 2, D) speeds and accelerations, see `changes`."""
    upper_body: Ints
    """Columns of the upper body."""
    _bounds: dict[Window, _Bound] = field(default_factory=dict)

    def of_part(self, part: Part, values: Singles) -> Singles:
        """(..., E) what a part compares of the changes (..., 2, D) of any clip."""
        columns: Singles = values[..., int(part.acceleration), :]
        return columns[..., self.upper_body] if part.upper_body else columns

    def bound(self, window: Window) -> _Bound:
        """The bound for a length of windows; computed once. The clip must have such a window."""
        if window not in self._bounds:
            values = self.of_part(window.part, self.changes)
            components = _principal(values.astype(float), _COMPONENTS)
            waves = _waves(window.samples)
            _, along = _along(values[None, ::EVERY], components, waves, 1)
            directions = waves @ _principal(along[0], window.directions)
            energy, along = _along(values[None], components, directions, EVERY)
            self._bounds[window] = _Bound(components, directions, energy[0], _with_rest(along[0]))
        return self._bounds[window]


def best_match(first: FirstClip, run: range, second: Singles, allowed: Bools, limit: float) -> Match | None:
    """The best match of two windows, that of the first clip in a run of moments; None if no share is below the limit.

    `second` (2, M, 2, D) are the changes of the second clip at every tenth moment, as recorded and mirrored. `allowed`
    (M,) says which of these moments count.
    """
    best: Match | None = None
    for window in WINDOWS:
        best = _better_match(window, first, run, second, allowed, best.share if best else limit) or best
    return best


def _better_match(
    window: Window, first: FirstClip, run: range, second: Singles, allowed: Bools, limit: float
) -> Match | None:
    """`best_match` of the windows of one length and part."""
    size, stop = window.samples, run.stop - (window.samples - 1) * EVERY
    if len(allowed) < size or stop <= run.start:
        return None
    bound = first.bound(window)
    mine, theirs = (first.of_part(window.part, x) for x in (first.changes, second))
    energy, along = _along(theirs, bound.components, bound.directions, 1)
    least = window.part.least_change**2 * size * mine.shape[1]
    start = run.start + np.flatnonzero(bound.energy[run.start : stop] > 0.5 * least)
    mirrored, row = np.nonzero((energy > least) & sliding_window_view(allowed, size).all(axis=1))
    if not len(start) or not len(row):
        return None
    samples = np.arange(size)

    def correlations(block: Ints, pairs: Ints) -> Floats:
        b, a = block[pairs // len(start)], pairs % len(start)
        x, y = mine[start[a, None] + EVERY * samples], theirs[mirrored[b, None], row[b, None] + samples]
        energies = bound.energy[start[a]] * energy[mirrored[b], row[b]]
        out: Floats = np.einsum("nke,nke->n", x, y, dtype=float) / np.sqrt(energies)
        return out

    largest, pair = 1.0 - limit * window.largest_loss, None
    for block in np.array_split(np.arange(len(row)), 1 + len(row) * len(start) // _BOUNDED):
        bounds = _with_rest(along[mirrored[block], row[block]]) @ bound.features[start].T
        found, number = _largest(bounds.ravel(), partial(correlations, block), largest)
        if found > largest:
            largest, pair = found, (block[number // len(start)], number % len(start))
    if pair is None:
        return None
    b, a = pair
    times_s = int(start[a]) / GRID_HZ, int(row[b]) * EVERY / GRID_HZ, size * EVERY / GRID_HZ
    return Match((1.0 - largest) / window.largest_loss, *times_s, bool(mirrored[b]))


def _largest(bounds: Singles, values: Callable[[Ints], Floats], least: float) -> tuple[float, int]:
    """The largest of the values that have these upper bounds (N,), and its number; -inf if none can exceed the least.

    The value of the largest bound spares most others. The rest is sought in the order of the bounds.
    """
    number = int(np.argmax(bounds))
    if bounds[number] + _ROUNDING < least:
        return -np.inf, number
    largest = float(values(np.array([number]))[0])
    left = np.flatnonzero(bounds > max(largest, least) - _ROUNDING)
    left = left[np.argsort(-bounds[left], kind="stable")]
    for start in range(0, len(left), _TOGETHER):
        numbers = left[start : start + _TOGETHER]
        if largest > 1.0 - _ROUNDING or bounds[numbers[0]] + _ROUNDING < largest:
            break
        found = values(numbers)
        if found.max() > largest:
            largest, number = float(found.max()), int(numbers[np.argmax(found)])
    return largest, number


def _principal(values: Floats, count: int) -> Floats:
    """(D, count) principal components of values (N, D): orthonormal directions along which they are large."""
    out: Floats = np.linalg.eigh(values.T @ values)[1][:, -count:]
    return out


def _waves(size: int) -> Floats:
    """(S, C, F) orthonormal directions: each component in the lowest modes of the cosine transform over a window."""
    modes = np.cos(np.pi / size * np.outer(np.arange(size) + 0.5, np.arange(min(size, _MODES))))
    modes /= np.sqrt(np.sum(modes**2, axis=0))
    out: Floats = np.einsum("sm,cd->scmd", modes, np.eye(_COMPONENTS)).reshape(size, _COMPONENTS, -1)
    return out


def _along(values: Singles, components: Floats, directions: Floats, step: int) -> tuple[Floats, Floats]:
    """(V, W) energies of the windows of values (V, N, E) whose samples are `step` apart, and (V, W, K) unit windows."""
    exact, count = values.astype(float), values.shape[1] - (len(directions) - 1) * step
    power, reduced = np.sum(exact**2, axis=2), exact @ components
    at = [slice(start, start + count) for start in range(0, len(directions) * step, step)]
    energy: Floats = np.sum([power[:, samples] for samples in at], axis=0)
    along = sum((reduced[:, samples] @ d for samples, d in zip(at, directions, strict=True)), start=np.zeros(()))
    return energy, along / np.sqrt(np.maximum(energy, 1e-12))[..., None]


def _with_rest(along: Floats) -> Singles:
    """(N, K + 1) components of unit vectors (N, K), and the lengths of the rests."""
    rest = np.sqrt(np.maximum(1.0 - np.sum(along**2, axis=1, keepdims=True), 0.0))
    return np.concatenate([along, rest], axis=1).astype(np.float32)
