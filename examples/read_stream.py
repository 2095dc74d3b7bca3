"""Read frames from an IS-900: python examples/read_stream.py [PORT]

PORT is /dev/ttyUSB0, COM3 or tcp://HOST:PORT. Without it, an emulated device plays a walk in real time.
"""

import sys
from itertools import islice

import harness
from harness.experiment import prepare_playback
from harness.stream.is900 import DriverConfig


def read(port: str, stations: tuple[str, ...] | None = None, frames: int = 40) -> None:
    with harness.Is900(port, DriverConfig(stations=stations)) as device:
        print(f"{device.identification}, {device.wire.rate_hz:.0f} frames per second")
        for frame in islice(device, frames):
            words = [
                f"{name} ({x:+.2f}, {y:+.2f}, {z:+.2f}) m" if valid else f"{name} lost"
                for name, valid, (x, y, z) in zip(device.stations, frame.position_valid, frame.position_m, strict=True)
            ]
            print(f"{frame.measured_s[0]:8.3f} s: {', '.join(words)}")


def main(port: str | None) -> None:
    if port is not None:
        read(port)
        return
    playback = prepare_playback("demo", clip="walking_p1_01", stations=["head", "left_hand"])
    with harness.serve_emulator(playback.samples, tcp="127.0.0.1:0") as emulator:
        read(emulator.name, playback.samples.stations)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else None)
