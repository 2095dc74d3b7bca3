"""What a live session came to, for people and for programs."""

from collections.abc import Mapping
from typing import Any

from harness.core.number_format import format_fixed
from harness.core.text_table import Table
from harness.live.session import LiveResult


def as_dict(done: LiveResult, floor: Mapping[str, Any]) -> dict[str, Any]:
    """Counts; times in milliseconds."""
    stages = done.stages
    return {
        "seconds": done.seconds,
        "frames": done.captured,
        "frames_before": done.frames_before,
        "frames_dropped": done.dropped,
        "poses": done.poses,
        "status": done.status,
        "deadline_ms": 1e3 * stages.deadline_s,
        "deadline_missed": stages.missed,
        "latency": {name: durations.as_dict() for name, durations in stages.by_name().items()},
        "floor": dict(floor),
        "outputs_failed": done.failed,
    }


def lines(done: LiveResult, floor: Mapping[str, Any]) -> list[str]:
    """A table of the times, with what the computer itself takes below, and the counts."""
    stages = done.stages
    rows = [_time_row(name, durations.as_dict()) for name, durations in stages.by_name().items()]
    rows += [_time_row(name, floor[key]) for name, key in _JITTER_LABELS.items() if floor.get(key)]
    states = ", ".join(f"{count} {name}" for name, count in done.status.items())
    counts = f"{done.poses} poses in {done.seconds:.1f} s ({states}); {done.dropped} frames dropped"
    if done.frames_before:
        counts += f", {done.frames_before} before the first"
    share = stages.missed / done.poses if done.poses else 0.0
    late = f"{stages.missed} poses ({share:.2%}) after their deadline, {1e3 * stages.deadline_s:.2f} ms"
    failed = [f"{name}: {why}" for name, why in done.failed.items()]
    table = Table(["milliseconds", "p50", "p99", "max"], rows)
    return [*table.lines(), "", counts, late, *failed]


_JITTER_LABELS = {
    "the computer: a timer is late": "timer",
    "the computer: thread to thread": "handover",
}


def _time_row(name: str, times: Mapping[str, float | None]) -> list[str]:
    return [name, *("-" if ms is None else format_fixed(ms, 2) for ms in times.values())]
