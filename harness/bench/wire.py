"""Latency over a line in real time: an emulator in one process, `harness live` in another.

The emulator records when each record was due and when its last byte was written. The live session records when each
pose was ready. The difference is the latency of the whole path, with the system's pipes and the waits of both programs.
The operating system's scheduling jitter is measured at the same time.
"""

import csv
import json
import math
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from subprocess import PIPE
from typing import Any, NamedTuple

import numpy as np

from harness.bench.cpu_time import hold_cpu_to_limit, overbooked, time_cpu
from harness.bench.limits import hold_to_limit
from harness.bench.wire_device import CASES, CLIP, SCENARIO, WireCase
from harness.core.arrays import Bools, Floats
from harness.core.child_process import PythonProcess, run_python
from harness.experiment import prepare_playback
from harness.results.findings import BenchmarkStatement
from harness.stream.polhemus.codec import (
    STATION_CHARACTERS,
    Decoder,
    FrameReader,
    RecordFormat,
    format_records,
    record_type,
)

METHOD = "expert_map"
SECONDS, LONG_S = 15.0, 600.0
"""Duration of the measurement of each line, and with --large [s]."""
DECODED, MAX_DECODING_UNITS = 100_000, 3.5
"""Number of records, and the most CPU time to decode them (see `cpu_time`)."""
MAX_ABOVE_TIMER_MS = 5.0
"""Largest p99 of the way from the last byte to the pose, above the timer's p99 of the same run [ms]."""
_TICK_S = RecordFormat().seconds_per_tick


class LineRun(NamedTuple):
    """One run of a line."""

    poses: int
    """Number of records with a pose."""
    lost: int
    """Number of records without one."""
    pacing_p99_ms: float
    """99th percentile of the delay of the emulator's writes [ms]."""
    latency_p50_ms: float
    """Median time from the last byte of a frame to its pose [ms]."""
    latency_p99_ms: float
    latency_max_ms: float
    timer_p99_ms: float
    """99th percentile of the delay of the operating system's timer, at the same time [ms]."""


def bench_wire(seed: int = 1, *, large: bool = False, runs: int = 1, repeats: int = 7) -> list[BenchmarkStatement]:
    """Measure decoding, then each line in real time, `runs` times in turn; rows have medians over the runs."""
    rows, seconds = _decoding_rows(seed, repeats), LONG_S if large else SECONDS
    by_case: dict[WireCase, list[LineRun]] = {case: [] for case in CASES}
    for _ in range(runs):
        for case, line_runs in by_case.items():
            with tempfile.TemporaryDirectory(prefix="harness-wire-") as folder:
                line_runs.append(_run_line(case, seconds, seed, Path(folder)))
    return rows + [row for case, line_runs in by_case.items() for row in line_rows(case, seconds, line_runs)]


def _decoding_rows(seed: int, repeats: int) -> list[BenchmarkStatement]:
    """Decoding rates of one core, by CPU time: blocks of records in both formats, and single records as from a port."""
    playback = prepare_playback(SCENARIO, clip=CLIP, seed=seed).simulation
    wire, items = playback.wire_format, playback.wire_format.items
    binary = playback.wire.data * 10
    table = np.frombuffer(binary, record_type(items))
    text = format_records(items, table)
    records = [playback.wire.data[at : at + table.itemsize] for at in range(0, len(playback.wire.data), table.itemsize)]
    lists = dict.fromkeys(wire.characters, items)

    def decode_singly() -> None:
        reader = FrameReader(wire)
        for data, received_s in zip(records, playback.wire.received_s.tolist(), strict=True):
            reader.feed(data, received_s)

    contenders: tuple[tuple[Callable[[], object], int], ...] = (
        (lambda: Decoder(lists).feed(binary), len(table)),
        (lambda: Decoder(lists, RecordFormat(binary=False)).feed(text), len(table)),
        (lambda: FrameReader(wire).feed_all(playback.wire), len(records)),
        (decode_singly, len(records)),
    )
    seconds = np.array([[time_cpu(work) for work, _ in contenders] for _ in range(repeats)])
    rate = [count / s for (_, count), s in zip(contenders, np.median(seconds, axis=0).tolist(), strict=True)]
    rows = []
    for name, each, length in (("binary", rate[0], "38 bytes"), ("ASCII", rate[1], f"{len(text) // len(table)} bytes")):
        rows += [
            hold_to_limit(f"decoding {name} records", each, "records/s", reference=f"{length}, in blocks"),
            hold_cpu_to_limit(f"decoding {DECODED:,} {name} records", DECODED / each, MAX_DECODING_UNITS),
        ]
    return [
        *rows,
        hold_to_limit("binary records into frames", rate[2], "records/s", reference="in blocks"),
        hold_to_limit(
            "binary records into frames, one at a time", 1e6 / rate[3], "us/record", reference="as from a port"
        ),
    ]


def _run_line(case: WireCase, seconds: float, seed: int, folder: Path) -> LineRun:
    port = str(folder / "tracker") if case.kind == "pty" else "127.0.0.1:0"
    pace = "paced" if case.kind == "pty" else "unpaced"
    arguments = [str(folder / "sent.npz"), str(seed), str(case.stations), str(case.rate_hz), case.kind, pace, port]
    with start_device(*arguments) as device:
        name = device.stdout.readline().strip() if device.stdout else ""
        report = _run_live(name, case, seconds, seed, folder / "poses.csv")
        device.finish(math.inf)  # it ends with its standard input
    if device.returncode:
        raise RuntimeError(f"the emulator ended with {device.returncode}")
    return _line_run(case, report, np.load(folder / "sent.npz"), folder / "poses.csv")


def start_device(*arguments: str) -> PythonProcess:
    """Start `wire_device`: it prints its name, and ends when its standard input does."""
    return PythonProcess("harness.bench.wire_device", *arguments, stdin=PIPE, stdout=PIPE, stderr=None)


def _run_live(port: str, case: WireCase, seconds: float, seed: int, poses: Path) -> dict[str, Any]:
    command = ["live", "--port", port, "--scenario", SCENARIO, "--clip", CLIP]
    command += ["--stations", str(case.stations), "--rate", str(case.rate_hz), "--method", METHOD]
    command += ["--items", ",".join(map(str, case.items)), "--seconds", str(seconds), "--seed", str(seed)]
    command += ["--poses", str(poses), "--json"]
    return dict(json.loads(run_python("harness.cli", *command)))


def _line_run(case: WireCase, report: dict[str, Any], sent: Any, poses: Path) -> LineRun:
    table = np.frombuffer(sent["data"].tobytes(), record_type(case.items))
    begin = _last_clock_reset(table["time"])  # earlier records served to measure the device's rate
    table, due_s, written_s = table[begin:], sent["due_s"][begin:], sent["written_s"][begin:]
    station = np.frombuffer(STATION_CHARACTERS, np.uint8).searchsorted(table["station"])
    stamp_s = table["time"].astype(float) * _TICK_S
    posed_s = _pose_times(poses, case.stations)
    ready_s = np.array([posed_s[s].get(t, np.nan) for s, t in zip(station.tolist(), stamp_s.tolist(), strict=True)])
    lost, latency_s = _losses_and_latency(written_s, ready_s)
    late_ms = 1e3 * (written_s - due_s)[~np.isnan(written_s)]
    p50, p99, most = (1e3 * float(np.quantile(latency_s, share)) for share in (0.5, 0.99, 1.0))
    timer_p99_ms = float(report["floor"]["timer"]["p99_ms"])
    pacing_p99_ms = float(np.quantile(late_ms, 0.99))
    return LineRun(int(np.sum(~np.isnan(ready_s))), int(lost.sum()), pacing_p99_ms, p50, p99, most, timer_p99_ms)


def line_rows(case: WireCase, seconds: float, runs: Sequence[LineRun]) -> list[BenchmarkStatement]:
    """The rows of one line, from all its runs of `seconds` [s]: all losses, and medians of the times.

    On an overbooked machine they have no verdict.
    """
    median = LineRun(*np.median(np.array(runs, dtype=float), axis=0).tolist())
    above_ms = np.array([run.latency_p99_ms - run.timer_p99_ms for run in runs])
    poses, lost = sum(run.poses for run in runs), sum(run.lost for run in runs)
    times = "one run" if len(runs) == 1 else f"median of {len(runs)} runs"
    timer = f"timer p99 {median.timer_p99_ms:.2f} ms late"
    latency = f"p50 {median.latency_p50_ms:.2f}, p99 {median.latency_p99_ms:.2f}, max {median.latency_max_ms:.1f} ms"
    spread = "" if len(runs) == 1 else f"; {above_ms.min():.2f} to {above_ms.max():.2f} ms"
    count = f"of {poses} in {len(runs)} x {seconds:g} s"
    doubt, pacing = overbooked(median.timer_p99_ms), f"{times}; {timer}"
    return [
        hold_to_limit(f"{case.name}: records without a pose", float(lost), most=0.0, reference=count, doubt=doubt),
        hold_to_limit(f"{case.name}: pacing error p99", median.pacing_p99_ms, "ms", reference=pacing),
        hold_to_limit(
            f"{case.name}: last byte to pose p99, above the timer's",
            float(np.median(above_ms)),
            "ms",
            most=MAX_ABOVE_TIMER_MS,
            reference=f"{times}{spread}; {latency}; {timer}",
            doubt=doubt,
        ),
    ]


def _last_clock_reset(time: Floats) -> int:
    """Index of the first record after the last reset of the device's clock."""
    resets = np.flatnonzero(np.diff(time) < 0.0)
    return int(resets[-1]) + 1 if len(resets) else 0


def _pose_times(poses: Path, stations: int) -> list[dict[float, float]]:
    """For each station: device time stamp -> time when its pose was ready [s]."""
    out: list[dict[float, float]] = [{} for _ in range(stations)]
    with poses.open(newline="") as file:
        rows = csv.DictReader(file)
        names = [name for name in rows.fieldnames or () if name.startswith("device_s.")]
        for row in rows:
            for station, name in enumerate(names):
                out[station][float(row[name])] = float(row["ready_s"])
    return out


def _losses_and_latency(written_s: Floats, ready_s: Floats) -> tuple[Bools, Floats]:
    """Records (N,) without a pose, between the first and the last with one; and the latency of each frame [s].

    The latency is the time from the last byte of a frame to its pose.
    """
    posed = np.flatnonzero(~np.isnan(ready_s))
    if len(posed) == 0:
        raise RuntimeError("no record of the emulator led to a pose")
    lost = np.isnan(ready_s)
    lost[: posed[0]] = lost[posed[-1] :] = False
    pose_s, frame = np.unique(ready_s[posed], return_inverse=True)
    complete_s = np.full(len(pose_s), -np.inf)
    np.maximum.at(complete_s, frame, written_s[posed])
    return lost, pose_s - complete_s
