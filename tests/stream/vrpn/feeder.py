"""A VRPN server that reports rounds of poses, and one that sends whatever a test wants."""

import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace

from harness.stream.vrpn.client import VrpnTiming
from harness.stream.vrpn.messages import PoseReport
from harness.stream.vrpn.server import VrpnServer

TRACKER, PERIOD_S = "Tracker0", 0.01
QUICK = VrpnTiming(connect_s=10.0, silent_s=10.0, measure_s=0.3, longest_measure_s=10.0, retry_s=0.02, poll_s=0.02)
IMPATIENT = replace(QUICK, silent_s=0.3, longest_measure_s=0.5)
"""For servers that say nothing."""


class Feeder:
    """Sends rounds of reports of some sensors, about 100 a second, until it is stopped; `sent` has all of them."""

    def __init__(self, server: VrpnServer, sensors: tuple[int, ...] = (0, 1)) -> None:
        self.server, self.sensors = server, sensors
        self.sent: list[PoseReport] = []
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while not self._stopped.wait(PERIOD_S):
            number, now_us = len(self.sent), time.time_ns() // 1000
            reports = [
                PoseReport(sensor, now_us + row, (number / 3.0, -row / 7.0, 1e-3), (0.6, 0.0, 0.8, 0.0))
                for row, sensor in enumerate(self.sensors)
            ]
            self.sent += reports
            self.server.send(TRACKER, reports)

    def stop(self) -> None:
        self._stopped.set()
        self._thread.join()


@contextmanager
def fed_server(port: int = 0, sensors: tuple[int, ...] = (0, 1)) -> Iterator[Feeder]:
    """A server on this computer whose tracker reports."""
    with VrpnServer([TRACKER], port=port) as server:
        feeder = Feeder(server, sensors)
        try:
            yield feeder
        finally:
            feeder.stop()


def port_of(server: VrpnServer, tracker: str = TRACKER) -> str:
    """What the client opens."""
    return f"vrpn:{tracker}@127.0.0.1:{server.port}"


@contextmanager
def scripted_server(script: Callable[[socket.socket], None]) -> Iterator[str]:
    """A TCP server that runs a script with each connection, one after another, and closes it then."""
    listening = socket.create_server(("127.0.0.1", 0))

    def run() -> None:
        with suppress(OSError):  # closed
            while True:
                connection, _ = listening.accept()
                with connection, suppress(OSError):
                    script(connection)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield f"vrpn:{TRACKER}@127.0.0.1:{listening.getsockname()[1]}"
    finally:
        listening.shutdown(socket.SHUT_RDWR)
        listening.close()
        thread.join()


def wait_until_closed(connection: socket.socket) -> None:
    """Read until the other side leaves."""
    while connection.recv(4096):
        pass
