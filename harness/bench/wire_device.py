"""An emulator in a process of its own that keeps when each record was due and when it was written.

    python -m harness.bench.wire_device FILE SEED STATIONS RATE pty|tcp paced|unpaced PORT

prints the port's name when it is there, plays until its input ends, and leaves `due_s`, `written_s`, `unread` and the
bytes of every record in the file. Times are of the monotonic clock, which all processes on Linux share.
"""

import sys
from pathlib import Path
from threading import Thread

import numpy as np

from harness.bench.wire_cases import CLIP, SCENARIO
from harness.experiment.playback import prepare_playback
from harness.stream.emulator import EmulatorConfig, SentMessage, serve_emulator


def main(into: str, seed: str, stations: str, rate_hz: str, kind: str, pace: str, port: str) -> None:
    played = prepare_playback(SCENARIO, clip=CLIP, stations=int(stations), rate_hz=float(rate_hz), seed=int(seed))
    kept: list[SentMessage] = []
    config = EmulatorConfig(paced=pace == "paced", seed=int(seed))
    where = {"pty": Path(port)} if kind == "pty" else {"tcp": port}
    with serve_emulator(played.samples, config, on_sent=kept.append, **where) as device:
        print(device.name, flush=True)
        waiting = Thread(target=sys.stdin.read)
        waiting.start()
        waiting.join()
    records = [sent for sent in kept if sent.message.station]
    last = records[-1:] and len(records[-1].data)
    alike = [sent for sent in records if len(sent.data) == last]
    np.savez(
        into,
        due_s=[sent.due_s for sent in alike],
        written_s=[sent.written_s for sent in alike],
        unread=[sent.unread for sent in alike],
        data=np.frombuffer(b"".join(sent.data for sent in alike), np.uint8),
        dropped=device.server.emulator.line.dropped,
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
