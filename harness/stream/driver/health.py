"""Health of a running stream: counts, frame rate and silence."""

from collections.abc import Iterable, Mapping

_TOGETHER_S = 1e-6
"""Frames of one read get times that differ by less than this [s]."""
_SHORTEST_RATE_WINDOW_S = 0.2
"""Shortest time over which it is computed [s]; USB adapters deliver frames in bursts 0.016 s apart."""


def describe_health(counts: Mapping[str, int], recent_s: Iterable[float], silent_s: float) -> dict[str, float]:
    """The counts, the frame rate [Hz] of frames received at `recent_s` [s], and the time since the last byte [s].

    `rate_hz` is absent until enough frames have arrived to tell it.
    """
    rate_hz = arrival_rate_hz(list(recent_s))
    rate = {} if rate_hz is None else {"rate_hz": rate_hz}
    return {**counts, **rate, "silent_s": silent_s}


def arrival_rate_hz(received_s: list[float]) -> float | None:
    """Frames per second of frames received at these times [s]; None for too short a time.

    Frames that arrived together with the first are left out: nothing tells how long they waited.
    """
    later = sum(1 for at_s in received_s if at_s - received_s[0] > _TOGETHER_S)
    span_s = received_s[-1] - received_s[0] if received_s else 0.0
    return later / span_s if span_s >= _SHORTEST_RATE_WINDOW_S else None
