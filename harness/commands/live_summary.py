"""Summary of a live session, for JSON and for a terminal."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from harness.core.humanoid24 import standard_skeleton
from harness.core.number_format import format_fixed, format_share
from harness.core.text_table import Table
from harness.live import LiveResult, describe_uncertainty


def as_dict(result: LiveResult, jitter: Mapping[str, Any]) -> dict[str, Any]:
    """Counts, and times in milliseconds; `jitter` is the result of `JitterProbe.finish`."""
    stages, sigma_rad = result.stages, result.mean_sigma_rad
    return {
        "seconds": result.seconds,
        "frames": result.captured,
        "frames_dropped": result.dropped,
        "poses": result.poses,
        "status": result.status,
        "origin": result.origin,
        "sigma_width_deg": None if sigma_rad is None else float(np.rad2deg(sigma_rad.mean())),
        "deadline_ms": 1e3 * stages.deadline_s,
        "deadline_missed": stages.missed,
        "lag_frames": result.lag_frames,
        "lag_ms": 1e3 * result.lag_s,
        "latency": {name: durations.as_dict() for name, durations in stages.by_name().items()},
        "latency_with_lag": _with_lag(result),
        "floor": dict(jitter),
        "outputs_failed": result.failed,
    }


def lines(result: LiveResult, jitter: Mapping[str, Any]) -> list[str]:
    """A table of latencies with the computer's scheduling jitter below, and the counts, as lines of text."""
    stages = result.stages
    rows = [_time_row(name, durations.as_dict()) for name, durations in stages.by_name().items()]
    if result.lag_frames:
        rows.append(_time_row(f"with the method's {result.lag_text}", _with_lag(result)))
    rows += [_time_row(name, jitter[key]) for name, key in _JITTER_LABELS.items() if jitter.get(key)]
    states = "; ".join(
        ", ".join(f"{count} {name}" for name, count in counted.items()) for counted in (result.status, result.origin)
    )
    counts = f"{result.poses} poses in {result.seconds:.1f} s ({states}); {result.dropped} frames dropped"
    share = stages.missed / result.poses if result.poses else 0.0
    late = f"{stages.missed} poses ({format_share(share, 2)}) after their deadline, {1e3 * stages.deadline_s:.2f} ms"
    stated = [describe_uncertainty(standard_skeleton(), result.mean_sigma_rad)] if result.poses else []
    failed = [f"{name}: {why}" for name, why in result.failed.items()]
    table = Table(["milliseconds", "p50", "p99", "max"], rows)
    return [*table.lines(), "", counts, *stated, late, *failed]


_JITTER_LABELS = {
    "the computer: a timer is late": "timer",
    "the computer: thread to thread": "handover",
}


def _with_lag(result: LiveResult) -> dict[str, float | None]:
    """Times from the last byte of the frame that a pose answers until the pose is ready [ms]; None without poses."""
    times = result.stages.to_pose.as_dict().items()
    return {name: None if ms is None else ms + 1e3 * result.lag_s for name, ms in times}


def _time_row(name: str, times: Mapping[str, float | None]) -> list[str]:
    return [name, *("-" if ms is None else format_fixed(ms, 2) for ms in times.values())]
