"""Rate, loss, latency and quality of the last 60 seconds, for the charts of the live page."""

from collections import deque
from typing import Any

import numpy as np

from harness.core.arrays import Floats

SECONDS = 60
LOST_AFTER_S = 0.5
"""A station or the line is lost when nothing valid came for so long [s]."""


class LineHistory:
    """A summary of each second, made from the records of `PoseRing`."""

    def __init__(self, stations: int, began_s: float) -> None:
        """`began_s` is the present time of the clock of the records [s]."""
        self._summaries: deque[dict[str, Any]] = deque(maxlen=SECONDS)
        self._second_s, self._frame_s = began_s, began_s
        self._valid_s = np.full(stations, began_s)
        self._latency_ms: list[float] = []
        self._quality: list[Floats] = []
        self._valid: list[Floats] = []

    def add(self, ready_s: float, latency_s: float, quality: Floats, valid: Floats) -> None:
        """Add a frame: when its pose was ready, its latency [s], quality (S,) and whether a reading was valid (S,)."""
        self._frame_s = ready_s
        self._valid_s[valid > 0.0] = ready_s
        self._latency_ms.append(1e3 * latency_s)
        self._quality.append(np.where(valid > 0.0, quality, 0.0))
        self._valid.append(valid)

    def update(self, now_s: float) -> None:
        """Close the second if it is over."""
        elapsed_s = now_s - self._second_s
        if elapsed_s < 1.0:
            return
        frames = len(self._latency_ms)
        p50, p99 = np.quantile(self._latency_ms, (0.5, 0.99)) if frames else (None, None)
        quality = np.mean(self._quality, axis=0) if frames else np.zeros(len(self._valid_s))
        self._summaries.append(
            {
                "rate_hz": round(frames / elapsed_s, 2),
                "p50_ms": None if p50 is None else round(float(p50), 3),
                "p99_ms": None if p99 is None else round(float(p99), 3),
                "loss": round(float(1.0 - np.mean(self._valid)), 4) if frames else 1.0,
                "quality": np.round(quality, 3).tolist(),
            }
        )
        self._second_s, self._latency_ms, self._quality, self._valid = now_s, [], [], []

    def content(self, now_s: float) -> dict[str, Any]:
        """The summaries, oldest first, which stations are lost, and how long nothing came [s]."""
        silent_s = now_s - self._frame_s
        lost = (now_s - self._valid_s > LOST_AFTER_S).tolist()
        return {"seconds": list(self._summaries), "lost": lost, "silent_s": round(silent_s, 1)}
