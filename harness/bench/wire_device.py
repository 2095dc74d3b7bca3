"""The lines of `harness bench wire`, and an emulator in a process of its own that notes when records are due and sent.

    python -m harness.bench.wire_device FILE SEED STATIONS RATE pty|tcp paced|unpaced PORT

prints the name of the port when it is open, plays until its standard input ends, and writes `due_s`, `written_s`,
`unread` and the bytes of every record to the file. Times are those of the monotonic clock, which all processes on Linux
share [s].
"""

import sys
from dataclasses import dataclass
from pathlib import Path
from threading import Thread

import numpy as np

from harness.experiment import prepare_playback
from harness.stream import serve_emulator
from harness.stream.polhemus import EmulatorConfig, SentMessage
from harness.stream.polhemus.codec import SHORT_LIST, STANDARD_LIST, describe_list

SCENARIO, CLIP = "demo", "boxing_p1_01"


@dataclass(frozen=True)
class WireCase:
    """Number of stations and rate on one kind of line."""

    stations: int
    rate_hz: float
    items: tuple[int, ...]
    kind: str
    """"pty" or "tcp"; a pty is paced at 115200 baud, TCP is not."""

    @property
    def name(self) -> str:
        """The name in the table."""
        line = "pty at 115200" if self.kind == "pty" else "TCP, unpaced"
        return f"{self.rate_hz:g} Hz x {self.stations}, {describe_list(self.items)}, {line}"


CASES = (
    WireCase(4, 75.0, STANDARD_LIST, "pty"),
    WireCase(6, 50.0, STANDARD_LIST, "pty"),
    WireCase(4, 120.0, SHORT_LIST, "pty"),
    WireCase(4, 120.0, STANDARD_LIST, "tcp"),
)


def main(file: str, seed: str, stations: str, rate_hz: str, kind: str, pace: str, port: str) -> None:
    playback = prepare_playback(SCENARIO, clip=CLIP, stations=int(stations), rate_hz=float(rate_hz), seed=int(seed))
    messages: list[SentMessage] = []
    config = EmulatorConfig(paced=pace == "paced", seed=int(seed))
    address = {"pty": Path(port)} if kind == "pty" else {"tcp": port}
    with serve_emulator(playback.samples, config, on_sent=messages.append, **address) as device:
        print(device.name, flush=True)
        waiting = Thread(target=sys.stdin.read)
        waiting.start()
        waiting.join()
    records = [sent for sent in messages if sent.message.station]
    last = records[-1:] and len(records[-1].data)
    same_length = [sent for sent in records if len(sent.data) == last]
    np.savez(
        file,
        due_s=[sent.due_s for sent in same_length],
        written_s=[sent.written_s for sent in same_length],
        unread=[sent.unread for sent in same_length],
        data=np.frombuffer(b"".join(sent.data for sent in same_length), np.uint8),
        dropped=device.emulator.line.dropped,
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
