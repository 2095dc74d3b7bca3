"""What `live --view browser` costs: the latency of sessions with and without an open page, in turn.

An emulator plays in a process of its own. Each session is a process too. A reader of the page's events stands for the
browser: it reads every frame and draws nothing.
"""

import json
import re
import tempfile
from http.client import HTTPConnection, HTTPException
from pathlib import Path
from subprocess import PIPE
from threading import Thread

import numpy as np

from harness.bench.cpu_time import overbooked
from harness.bench.limits import hold_to_limit
from harness.bench.wire import start_device
from harness.bench.wire_device import SCENARIO
from harness.core.child_process import PythonProcess
from harness.errors import HarnessError
from harness.results.findings import BenchmarkStatement
from harness.view import EVENTS_PATH

PAIRS = 5
"""Pairs of sessions in one run of the benchmark."""
MAX_RATIO = 1.05
_SECONDS, _RATE_HZ, _STATIONS = 6.0, 40.0, 4


def bench_live_viewer(seed: int = 1, *, runs: int = 1) -> list[BenchmarkStatement]:
    """Measure `PAIRS` pairs of sessions `runs` times; HarnessError when a session fails."""
    with tempfile.TemporaryDirectory(prefix="harness-viewer-") as folder:
        arguments = [str(Path(folder) / "sent.npz"), str(seed), str(_STATIONS), str(_RATE_HZ), "pty", "paced"]
        with start_device(*arguments, str(Path(folder) / "tracker")) as device:
            port = device.stdout.readline().strip() if device.stdout else ""
            pairs = [
                [_session_p50_ms(port, with_page=with_page) for with_page in (False, True)] for _ in range(PAIRS * runs)
            ]
    return viewer_rows(pairs)


def viewer_rows(pairs: list[list[float]]) -> list[BenchmarkStatement]:
    """The row of pairs of medians [ms]: without a page, and with one."""
    without, shown = np.median(np.array(pairs), axis=0)
    reference = (
        f"p50 {shown:.2f} ms with a page, {without:.2f} ms without; medians of {2 * len(pairs)} sessions in turn"
    )
    name = "live --view browser: p50 latency, with a page / without"
    ratio, doubt = float(shown / without), overbooked()
    return [hold_to_limit(name, ratio, "x", most=MAX_RATIO, reference=reference, doubt=doubt)]


def _session_p50_ms(port: str, *, with_page: bool) -> float:
    """Median time from the last byte to the pose of one session [ms]."""
    words = ["--port", port, "--scenario", SCENARIO, "--stations", str(_STATIONS), "--rate", f"{_RATE_HZ:g}"]
    words += ["--seconds", f"{_SECONDS:g}", "--json", *(["--view", "browser", "--no-browser"] if with_page else [])]
    with PythonProcess("harness.cli", "live", *words, stdout=PIPE) as session:
        reader: Thread | None = None
        said = []
        for line in session.stderr or ():
            said.append(line)
            if found := re.search(r"view: http://(\S+)/", line):
                reader = Thread(target=_read_events, args=(found[1],), daemon=True)
                reader.start()
        content = (session.stdout.read() if session.stdout else "") or "{}"
        session.wait()
    if session.returncode or (with_page and reader is None):
        raise HarnessError(f"harness live failed: {''.join(said[-3:]).strip()}")
    return float(json.loads(content)["latency"]["last byte to pose"]["p50_ms"])


def _read_events(address: str) -> None:
    """Read the page and its events until the session ends; `address` is host:port."""
    last, answer = 0, b""
    try:
        connection = HTTPConnection(address)
        while True:
            connection.request("GET", f"{EVENTS_PATH}?after={last}" if answer else "/")
            answer = connection.getresponse().read()
            last = json.loads(answer)["last"] if answer.startswith(b"{") else 0
    except (OSError, HTTPException):  # the session has ended
        return
