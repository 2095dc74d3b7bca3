"""Statistics of the last minute of a live session: one summary a second, of rate, loss, latency and quality.

The solving thread adds frames, each in constant time. Another thread closes the seconds and computes the quantiles.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from threading import Lock
from typing import Any

import numpy as np

from harness.core.arrays import Bools, Floats
from harness.core.estimate import LOST_AFTER_S, Status
from harness.core.number_format import format_fixed
from harness.stream import StationCounts, TrackerFrame

SECONDS_KEPT = 60
"""Number of summaries that are kept."""


_STATUS_WORDS = {
    Status.SOLVED: ("OK", ""),
    Status.HELD: ("HELD", "too few readings: the pose is extrapolated"),
    Status.LOST: ("LOST", "fewer than half of the stations have readings"),
}
"""Word of the status of a pose, and what it means."""


@dataclass(frozen=True)
class SecondSummary:
    """What happened in about one second of a session."""

    end_s: float
    """End of the second, since the first frame [s]."""
    rate_hz: float
    """Frames with a pose per second [Hz]."""
    held: int
    """Poses that the method held."""
    lost: int
    """Poses that the method declared lost."""
    dropped: int
    """Frames that the queue dropped."""
    latency_p50_ms: float | None
    """Median time from the last byte of a frame to its pose [ms]; None without poses."""
    latency_p99_ms: float | None
    """99th percentile of that time [ms]."""
    quality: tuple[float, ...]
    """Mean quality of each station, 0 (lost) to 1; 0 without frames."""
    loss: tuple[float, ...]
    """Share of the frames without a valid reading of each station, 0 to 1; 1 without frames."""

    def page_content(self) -> dict[str, Any]:
        """The values of the live page's charts; loss is the mean over the stations."""
        p50, p99 = (None if ms is None else round(ms, 3) for ms in (self.latency_p50_ms, self.latency_p99_ms))
        return {
            "rate_hz": round(self.rate_hz, 2),
            "p50_ms": p50,
            "p99_ms": p99,
            "loss": round(sum(self.loss) / max(len(self.loss), 1), 4),
            "quality": [round(one, 3) for one in self.quality],
        }


class LiveStatistics:
    """Summaries of the last 60 seconds, and messages about stations that are lost or are back."""

    def __init__(self, stations: tuple[str, ...], clock: Callable[[], float]) -> None:
        self.stations = stations
        self._clock, self._lock = clock, Lock()
        self._began = False
        """Whether a frame has arrived. Earlier frames may serve a calibration, and the first second waits for them."""
        self._began_s = self._second_s = self._frame_s = clock()
        self._seen_s: Floats = np.full(len(stations), self._began_s)
        """Time of the last valid reading of each station [s]."""
        self._missing: Bools = np.zeros(len(stations), dtype=bool)
        self._delivered: Bools = np.zeros((2, len(stations)), dtype=bool)
        """Whether each station has ever had a valid position, and orientation."""
        self._whole: Bools = np.zeros(len(stations), dtype=bool)
        """Whether the newest frame has all that each station delivers."""
        self._status = Status.LOST
        self._summaries: deque[SecondSummary] = deque(maxlen=SECONDS_KEPT)
        self._second = _Second(len(stations))
        self._dropped = 0

    def add(self, frame: TrackerFrame, status: Status, latency_s: float) -> None:
        """Add a frame, the status of its pose and the time from its last byte to the pose [s]."""
        now_s, valid = self._clock(), frame.position_valid | frame.orientation_valid
        with self._lock:
            if not self._began:
                self._began, self._began_s, self._second_s = True, now_s, now_s
                self._seen_s[:] = now_s
            self._frame_s, self._status = now_s, status
            self._seen_s[valid] = now_s
            present = np.array([frame.position_valid, frame.orientation_valid])
            self._delivered |= present
            self._whole = valid & (present | ~self._delivered).all(axis=0)
            self._second.add(frame, status, latency_s)

    def update(self, dropped: int = 0) -> list[str]:
        """Close a second that is over; `dropped` is the number of frames dropped so far.

        Returns the messages about stations that were lost or came back since the last call. Call it often.
        """
        now_s = self._clock()
        with self._lock:
            if not self._began:
                return []
            second, began_s = self._second, self._second_s
            if over := now_s - began_s >= 1.0:
                self._second, self._second_s = _Second(len(self.stations)), now_s
            missing = self._frame_s - self._seen_s > LOST_AFTER_S
            seen_s = self._seen_s.copy()
        if over:
            self._summaries.append(second.summary(now_s - self._began_s, now_s - began_s, dropped - self._dropped))
            self._dropped = dropped
        changed = np.flatnonzero(missing != self._missing).tolist()
        self._missing = missing
        at = [format_fixed(float(s) - self._began_s, 1) for s in seen_s]
        return [f"station {self.stations[k]} {'lost' if missing[k] else 'back'} at {at[k]} s" for k in changed]

    def summaries(self) -> tuple[SecondSummary, ...]:
        """The summaries of the last 60 seconds, oldest first. Call it in the thread that calls `update`."""
        return tuple(self._summaries)

    def silent_s(self) -> float:
        """Time since the last frame [s]."""
        return self._clock() - self._frame_s

    @property
    def is_silent(self) -> bool:
        """Whether no frame has come for `LOST_AFTER_S`."""
        return self.silent_s() > LOST_AFTER_S

    def page_content(self) -> dict[str, Any]:
        """What the live page shows: the summaries, and of the session and each station OK, HELD or LOST.

        A session is what its newest pose is, and LOST while no frame comes for `LOST_AFTER_S`. A station is OK when the
        newest frame has all that it delivers, LOST without any valid reading for `LOST_AFTER_S`, and HELD in between.
        """
        silent, whole = self.is_silent, self._whole.tolist()
        gone = [silent or missing for missing in self._missing.tolist()]
        stations = ["LOST" if lost else "OK" if here else "HELD" for lost, here in zip(gone, whole, strict=True)]
        missing = [name for name, lost in zip(self.stations, gone, strict=True) if lost]
        word, why = _STATUS_WORDS[self._status]
        if not self._began:
            word, why = "LOST", "no pose yet"
        elif silent:
            word, why = "LOST", f"no data for {format_fixed(self.silent_s(), 1)} s"
        elif missing:
            why = f"{why}{'; ' if why else ''}no reading of {', '.join(missing)}"
        seconds = [one.page_content() for one in self._summaries]
        return {"seconds": seconds, "session": word, "why": why, "stations": stations}

    def status_line(self) -> str:
        """The last second in one line; "" before the first second is over."""
        if not self._summaries:
            return ""
        last = self._summaries[-1]
        if self.is_silent:
            return f"no data for {format_fixed(self.silent_s(), 1)} s"
        latency = "latency -"
        if last.latency_p50_ms is not None and last.latency_p99_ms is not None:
            p50, p99 = format_fixed(last.latency_p50_ms, 1), format_fixed(last.latency_p99_ms, 1)
            latency = f"p50 {p50} p99 {p99} ms"
        parts = [f"{format_fixed(last.rate_hz, 1)} Hz", latency, f"held {last.held}", f"lost {last.lost}"]
        if last.dropped:
            parts.append(f"dropped {last.dropped}")
        quality = " ".join(
            f"{name} {'lost' if gone else f'{100 * share:.0f}%'}"
            for name, share, gone in zip(self.stations, last.quality, self._missing.tolist(), strict=True)
        )
        return ", ".join([*parts, quality])


class _Second:
    """Sums over the second that is going on."""

    def __init__(self, stations: int) -> None:
        self.held = self.lost = 0
        self.latency_s: list[float] = []
        self.counts = StationCounts(stations)

    def add(self, frame: TrackerFrame, status: Status, latency_s: float) -> None:
        self.latency_s.append(latency_s)
        self.counts.add(frame)
        self.held += status is Status.HELD
        self.lost += status is Status.LOST

    def summary(self, end_s: float, duration_s: float, dropped: int) -> SecondSummary:
        frames = len(self.latency_s)
        p50, p99 = 1e3 * np.quantile(self.latency_s, (0.5, 0.99)) if frames else (None, None)
        return SecondSummary(
            end_s=end_s,
            rate_hz=frames / duration_s,
            held=self.held,
            lost=self.lost,
            dropped=dropped,
            latency_p50_ms=None if p50 is None else float(p50),
            latency_p99_ms=None if p99 is None else float(p99),
            quality=tuple(self.counts.mean_quality.tolist()),
            loss=tuple(self.counts.loss.tolist()),
        )
