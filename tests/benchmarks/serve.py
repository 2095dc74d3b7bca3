"""Delay that `harness record --serve` adds: an emulator, the recorder and a client, each in a process of its own.

The emulator notes when each record was written, the client when its last byte arrived. The operating system's
scheduling jitter is measured at the same time. The emulator's line is a pty, so that the difference of the two times
has two passes through a pty: emulator to recorder, and recorder to client.
"""

import math
import os
import select
import tempfile
import time
import tty
from pathlib import Path
from subprocess import DEVNULL
from typing import NamedTuple

import numpy as np

from harness.bench.cpu_time import overbooked
from harness.bench.limits import hold_to_limit
from harness.bench.wire import SECONDS, start_device
from harness.core.arrays import Floats
from harness.core.child_process import PythonProcess
from harness.live import JitterProbe
from harness.results.findings import BenchmarkStatement
from harness.stream.polhemus.codec import BINARY, CENTIMETRES, STANDARD_LIST, STOP, STREAM, ZERO_CLOCK, station_command
from harness.stream.recording import RECEIVED, read_recording

STATIONS, RATE_HZ = 4, 75.0
MAX_ABOVE_TIMER_MS = 1.0
"""Largest p99 of the delay above the timer's p99 of the same run [ms]."""
_START_S = 60.0
"""Longest wait for the recorder [s]."""
_ALIGNING_BYTES = 400
"""First bytes of the client, by which its bytes are found among those of the emulator."""


class ServedRun(NamedTuple):
    """One run."""

    delay_ms: Floats
    """(N,) time from the emulator's write of a record to its last byte at the client [ms]."""
    timer_p99_ms: float
    missing: int
    """Bytes of the client that the recording lacks."""
    direct_ms: Floats
    """(M,) the same without the recorder, just before [ms]."""


def bench_serve(seed: int = 1, *, runs: int = 1) -> list[BenchmarkStatement]:
    """Measure `runs` times; the rows have medians over the runs, and all missing bytes."""
    return served_rows([_run(seed) for _ in range(runs)])


def served_rows(runs: list[ServedRun]) -> list[BenchmarkStatement]:
    """The rows of all runs."""
    served = np.array([np.quantile(run.delay_ms, (0.5, 0.99)) for run in runs])
    direct = np.array([np.quantile(run.direct_ms, (0.5, 0.99)) for run in runs])
    timers = np.array([run.timer_p99_ms for run in runs])
    above, timer = np.median(served[:, 1] - timers), float(np.median(timers))
    (p50, p99), (direct_p50, direct_p99) = np.median(served, axis=0), np.median(direct, axis=0)
    line = f"record --serve, {RATE_HZ:g} Hz x {STATIONS}"
    times = "one run" if len(runs) == 1 else f"median of {len(runs)} runs"
    without = f"without recorder {direct_p50:.2f} and {direct_p99:.2f} ms"
    reference = f"{times}; p50 {p50:.2f}, p99 {p99:.2f} ms; timer p99 {timer:.2f} ms late; {without}"
    records = sum(len(run.delay_ms) for run in runs)
    name, missing, doubt = f"{line}: delay p99, above the timer's", sum(run.missing for run in runs), overbooked(timer)
    return [
        hold_to_limit(name, float(above), "ms", most=MAX_ABOVE_TIMER_MS, reference=reference, doubt=doubt),
        hold_to_limit(f"{line}: bytes that the recording lacks", missing, most=0.0, reference=f"of {records} records"),
    ]


def _run(seed: int) -> ServedRun:
    with tempfile.TemporaryDirectory(prefix="harness-serve-") as name:
        folder = Path(name)
        sent, link, recording = folder / "sent.npz", folder / "link", folder / "a.rec"
        arguments = [str(sent), str(seed), str(STATIONS), str(RATE_HZ), "pty", "paced", str(folder / "tracker")]
        with start_device(*arguments) as device:
            port = device.stdout.readline().strip() if device.stdout else ""
            direct = _read_client(Path(port), SECONDS)
            words = ["record", port, str(recording), "--serve", str(link)]
            with PythonProcess("harness.cli", *words, stderr=DEVNULL, shielded=False) as recorder:
                _wait_for(link, recorder)
                with JitterProbe() as probe:
                    served = _read_client(link, SECONDS)
                    timer = probe.finish()
                recorder.terminate()
                recorder.finish(math.inf)
            device.finish(math.inf)  # it ends with its standard input
        content = np.load(sent)
        recorded = b"".join(block.payload for block in read_recording(recording).blocks() if block.kind == RECEIVED)
    sent_data, written_s = content["data"].tobytes(), content["written_s"]
    direct_s = record_delays(sent_data, written_s, *direct)
    begin = len(direct_s)  # the emulator may send the same bytes twice
    delay_s = record_delays(sent_data[begin * len(sent_data) // len(written_s) :], written_s[begin:], *served)
    missing = 0 if served[0] in recorded else len(served[0])
    return ServedRun(1e3 * delay_s, float(timer["timer"]["p99_ms"]), missing, 1e3 * direct_s)


def _wait_for(link: Path, recorder: PythonProcess) -> None:
    until_s = time.monotonic() + _START_S
    while not link.is_symlink():
        if recorder.poll() is not None or time.monotonic() > until_s:
            raise RuntimeError("harness record --serve did not start")
        time.sleep(0.02)


def _read_client(link: Path, seconds: float) -> tuple[bytes, list[int], list[float]]:
    """Configure the device, read its stream for so long [s], and stop it.

    Returns the bytes of the stream, and for each read the number of bytes so far and the time [s].
    """
    port = os.open(link, os.O_RDWR | os.O_NOCTTY)
    try:
        tty.setraw(port)
        os.write(port, BINARY + CENTIMETRES)
        for station in range(STATIONS):
            os.write(port, station_command("O", str(station + 1), STANDARD_LIST))
        os.write(port, ZERO_CLOCK + STREAM)
        data, ends, received_s = bytearray(), [], []
        until_s = time.monotonic() + seconds
        while (left_s := until_s - time.monotonic()) > 0.0:
            if select.select([port], [], [], left_s)[0]:
                data += os.read(port, 4096)
                received_s.append(time.monotonic())
                ends.append(len(data))
        os.write(port, STOP)
    finally:
        os.close(port)
    return bytes(data), ends, received_s


def record_delays(sent: bytes, written_s: Floats, data: bytes, ends: list[int], received_s: list[float]) -> Floats:
    """(N,) time from the write of each record until the read with its last byte [s].

    `sent` has the records of one length, written at `written_s` (M,) [s]; `data` the bytes of the client, of which read
    k ended at byte `ends[k]` at `received_s[k]` [s]. RuntimeError where the client's bytes are not among those sent.
    """
    start = sent.find(data[:_ALIGNING_BYTES])
    if not data or start < 0 or sent[start : start + len(data)] != data:
        raise RuntimeError("the client did not receive what the emulator sent")
    length = len(sent) // len(written_s)
    last = np.arange(1, len(written_s) + 1) * length - start  # number of the client's bytes up to each record's end
    inside = (last > 0) & (last <= len(data))
    read = np.searchsorted(ends, last[inside])
    return np.asarray(np.array(received_s)[read] - written_s[inside])
