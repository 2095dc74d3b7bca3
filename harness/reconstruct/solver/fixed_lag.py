"""Fixed-lag smoothing: the pose of an earlier frame, from the causal poses of that frame and its neighbours.

A symmetric finite impulse response (FIR) filter averages 2 k + 1 poses about the frame that is answered, so it needs k
later frames and shifts nothing in time. Root positions are averaged linearly. Root orientations and hinge angles are
averaged as small rotations from the pose in the middle, so that angles may pass +-pi. At the start of a session a frame
has fewer neighbours: its window is then narrower and still symmetric, and the first frame is not smoothed.

`FixedLagFilter` takes estimates, `FixedLagSession` wraps a session. The estimates may have a lag of their own, which is
added to that of the filter.
"""

from collections import deque
from collections.abc import Sequence

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled
from harness.core.compiled_rotations import as_tuple, quaternion_product, rotation_vector
from harness.core.estimate import Estimate
from harness.reconstruct.contract import Session
from harness.stream import TrackerFrame

DEFAULT_WEIGHTS = (0.15, 0.7, 0.15)
"""Weights of three frames: a lag of one frame, with less damping of fast motion than (0.25, 0.5, 0.25)."""


class FixedLagFilter:
    """Smooths the estimates of one session.

    `weights` are 2 k + 1 numbers, symmetric about the largest, none negative; they are divided by their sum. ValueError
    for others.
    """

    def __init__(self, weights: Sequence[float] = DEFAULT_WEIGHTS) -> None:
        given = np.asarray(weights, dtype=float)
        if given.ndim != 1 or len(given) % 2 == 0 or not np.isfinite(given).all() or (given < 0.0).any():
            raise ValueError(f"weights {list(weights)}: expected an odd number of weights, none negative")
        middle = len(given) // 2
        if (given != given[::-1]).any() or not given[middle] == given.max() > 0.0:
            raise ValueError(
                f"weights {list(weights)}: expected a symmetric filter with its largest weight in the middle"
            )
        self._weights = given / given.sum()
        self._half = middle
        self._window: deque[Estimate] = deque(maxlen=len(given))
        """The estimates of the last frames that the session answered, one for each frame."""
        self._answered = self._steps = 0
        """Number of frames that the session has answered, and of its steps."""

    @property
    def lag(self) -> int:
        """Number of frames that the filter adds to the lag of the session."""
        return self._half

    def smooth(self, estimate: Estimate) -> Estimate:
        """The estimate of the frame that can be answered after this step of the session.

        It has the status and the origin of that frame. Its standard deviations are the weighted mean of those in the
        window: errors of neighbouring frames are nearly equal, so averaging reduces them hardly. ValueError when the
        lag of the session is not as `reconstruct.contract.Session` requires.
        """
        frame = self._steps - estimate.lag
        again = frame == 0 and self._answered == 1
        if frame != self._answered and not again:
            raise ValueError(f"step {self._steps} answers frame {frame}, after {self._answered} answered frames")
        if again:
            self._window.pop()
        self._window.append(estimate)
        self._answered = frame + 1
        wanted = max(frame - self._half, 0)
        out = self._pose_of(wanted, self._steps - wanted)
        self._steps += 1
        return out

    def _pose_of(self, frame: int, lag: int) -> Estimate:
        first = self._answered - len(self._window)
        half = min(self._half, frame - first, self._answered - 1 - frame)
        at = frame - first
        middle = self._window[at]
        if half == 0:
            return Estimate(middle.qpos, middle.status, middle.origin, middle.angle_sigma_rad, lag)
        weights = self._weights[self._half - half : self._half + half + 1]
        weights = weights / weights.sum()
        used = [self._window[n] for n in range(at - half, at + half + 1)]
        qpos = np.empty(len(middle.qpos))
        _average(np.array([estimate.qpos for estimate in used]), weights, qpos)
        sigmas_rad = [e.angle_sigma_rad for e in used if e.angle_sigma_rad is not None]
        sigma_rad = weights @ np.array(sigmas_rad) if len(sigmas_rad) == len(used) else None
        return Estimate(qpos, middle.status, middle.origin, sigma_rad, lag)


class FixedLagSession:
    """A session whose estimates are those of another one, smoothed with a fixed lag."""

    def __init__(self, inner: Session, weights: Sequence[float] = DEFAULT_WEIGHTS) -> None:
        self._inner, self._filter = inner, FixedLagFilter(weights)

    def step(self, frame: TrackerFrame) -> Estimate:
        return self._filter.smooth(self._inner.step(frame))


@compiled
def _average(qpos: Floats, weights: Floats, out: Floats) -> None:
    """Fill in the weighted mean (Q,) of an odd number N of configurations (N, Q) about the one in the middle."""
    middle = len(weights) // 2
    out[:] = qpos[middle]
    x = y = z = 0.0
    w0, x0, y0, z0 = qpos[middle, 3], qpos[middle, 4], qpos[middle, 5], qpos[middle, 6]
    for n in range(len(weights)):
        if n == middle:
            continue
        for k in range(3):
            out[k] += weights[n] * (qpos[n, k] - qpos[middle, k])
        turn = rotation_vector(quaternion_product((w0, -x0, -y0, -z0), as_tuple(qpos[n, 3:7])))
        x, y, z = x + weights[n] * turn[0], y + weights[n] * turn[1], z + weights[n] * turn[2]
        for d in range(7, qpos.shape[1]):
            difference = qpos[n, d] - qpos[middle, d]
            out[d] += weights[n] * (difference - 2.0 * np.pi * np.round(difference / (2.0 * np.pi)))
    angle = np.sqrt(x * x + y * y + z * z)
    share = 0.5 * np.sinc(0.5 * angle / np.pi)
    w, x, y, z = quaternion_product((w0, x0, y0, z0), (np.cos(0.5 * angle), share * x, share * y, share * z))
    length = np.sqrt(w * w + x * x + y * y + z * z)
    out[3], out[4], out[5], out[6] = w / length, x / length, y / length, z / length
