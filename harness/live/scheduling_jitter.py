"""What this computer does to a program that only sleeps: nothing here can be quicker than that.

A process of its own, `python -m harness.live.scheduling_jitter`, so that it is no part of what it stands beside. It sleeps again
and again, notes how late it wakes and how long a word takes to another of its threads, and prints both when its input
ends.
"""

import json
import subprocess
import sys
import time
from queue import SimpleQueue
from threading import Thread
from typing import Any

_SLEEP_S = 0.02


def main() -> None:
    """Until the standard input ends."""
    from harness.live.latency import DurationHistogram

    late, handed = DurationHistogram(), DurationHistogram()
    words: SimpleQueue[float | None] = SimpleQueue()
    ends: list[bool] = []

    def listen() -> None:
        while (said_s := words.get()) is not None:
            handed.add(time.monotonic() - said_s)

    listener, waiter = Thread(target=listen), Thread(target=lambda: ends.append(not sys.stdin.read()), daemon=True)
    listener.start()
    waiter.start()
    while not ends:
        asked_s = time.monotonic() + _SLEEP_S
        time.sleep(_SLEEP_S)
        woken_s = time.monotonic()
        late.add(woken_s - asked_s)
        words.put(woken_s)
    words.put(None)
    listener.join()
    print(json.dumps({"timer": late.as_dict(), "handover": handed.as_dict(), "sleeps": late.count}))


class JitterProbe:
    """Measures from now until `finish`; leaves nothing running behind when its block ends."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "harness.live.scheduling_jitter"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            start_new_session=True,  # Ctrl-C is not for this one
        )

    def __enter__(self) -> "JitterProbe":
        return self

    def __exit__(self, *raised: object) -> None:
        self._process.kill()
        self._process.communicate()

    def finish(self) -> dict[str, Any]:
        """`timer` and `handover` in milliseconds, `sleeps` how many times; {} if it could not be measured."""
        try:
            said, _ = self._process.communicate(timeout=10.0)
        except subprocess.TimeoutExpired:
            return {}
        return dict(json.loads(said)) if said.strip() else {}


if __name__ == "__main__":
    main()
