"""Measurement of the operating system's scheduling jitter, the lower limit of a live session's latency.

It runs in a process of its own, `python -m harness.live.scheduling_jitter`, so that the session does not disturb it.
The process sleeps repeatedly and measures how late it wakes, and how long a message to another of its threads takes.
It prints both when its standard input ends.
"""

import json
import sys
import time
from queue import SimpleQueue
from subprocess import DEVNULL, PIPE
from threading import Thread
from typing import Any

from harness.core.child_process import PythonProcess

_SLEEP_S = 0.02


def main() -> None:
    """Measure until the standard input ends, then print the durations as JSON."""
    from harness.live.latency import DurationHistogram

    lateness, handover = DurationHistogram(), DurationHistogram()
    messages: SimpleQueue[float | None] = SimpleQueue()
    input_ended: list[bool] = []

    def listen() -> None:
        while (sent_s := messages.get()) is not None:
            handover.add(time.monotonic() - sent_s)

    listener, waiter = (
        Thread(target=listen),
        Thread(target=lambda: input_ended.append(not sys.stdin.read()), daemon=True),
    )
    listener.start()
    waiter.start()
    while not input_ended:
        due_s = time.monotonic() + _SLEEP_S
        time.sleep(_SLEEP_S)
        woken_s = time.monotonic()
        lateness.add(woken_s - due_s)
        messages.put(woken_s)
    messages.put(None)
    listener.join()
    print(json.dumps({"timer": lateness.as_dict(), "handover": handover.as_dict(), "sleeps": lateness.count}))


class JitterProbe:
    """Runs the measurement until `finish`; a context manager, which starts and ends the process."""

    def __enter__(self) -> "JitterProbe":
        self._process = PythonProcess("harness.live.scheduling_jitter", stdin=PIPE, stdout=PIPE, stderr=DEVNULL)
        return self

    def __exit__(self, *raised: object) -> None:
        self._process.close()

    def finish(self) -> dict[str, Any]:
        """End the measurement: `timer` and `handover` [ms] and the number of `sleeps`; {} if it failed."""
        text, _ = self._process.finish(10.0) or ("", "")
        return dict(json.loads(text)) if text.strip() else {}


if __name__ == "__main__":
    main()
