"""The driver at real ports in real time, against the emulator: a `TrackerStream` that leaves nothing open."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from itertools import islice, pairwise
from pathlib import Path

import pytest

from harness.errors import BadInput
from harness.stream.emulators import serve_emulator
from harness.stream.frame import TrackerFrame
from harness.stream.is900.driver.config import DriverConfig
from harness.stream.is900.driver.is900 import Is900
from harness.stream.line_events import LineEvent
from harness.stream.polhemus.driver.config import DriverTiming
from harness.stream.polhemus.emulator.config import EmulatorConfig
from harness.stream.polhemus.emulator.faults import Fault
from harness.stream.polhemus.emulator.server import EmulatorServer
from harness.testing.stream_checks import check_stream
from tests.interrupts import heeding_interrupts
from tests.stream.is900.driver.bench import make_samples

TIMEOUT_S = 120.0
"""Time that a loaded machine gets before a test fails [s]."""
PORT_KINDS = ["pty", "tcp"]
Serve = Callable[..., AbstractContextManager[EmulatorServer]]


@pytest.fixture(params=PORT_KINDS)
def serve(request: pytest.FixtureRequest, tmp_path: Path) -> Serve:
    def serve_at(config: EmulatorConfig | None = None) -> AbstractContextManager[EmulatorServer]:
        if request.param == "pty":
            return serve_emulator(make_samples(4), config, pty=tmp_path / "is900")
        return serve_emulator(make_samples(4), config, tcp="127.0.0.1:0")

    return serve_at


def until(stream: Is900, condition: Callable[[TrackerFrame], bool]) -> list[TrackerFrame]:
    """Return frames until one meets the condition."""
    frames, ends_s = list[TrackerFrame](), time.monotonic() + TIMEOUT_S
    for frame in stream:
        frames.append(frame)
        if condition(frame) or time.monotonic() > ends_s:
            break
    return frames


@pytest.mark.long
def test_the_stream_contract_holds(serve: Serve) -> None:
    with serve() as emulator:
        opened: list[Is900] = []

        def make() -> Is900:
            for stream in opened:
                stream.close()
            opened.append(Is900(emulator.name))
            return opened[-1]

        assert len(check_stream(make, rate_hz=50.0, at_most=60)) == 60
        opened[-1].close()
        assert not emulator.emulator.device.streaming


@pytest.mark.long
def test_the_driver_reconnects_after_unplugging(serve: Serve) -> None:
    events: list[LineEvent] = []
    with serve(EmulatorConfig(faults=(Fault("disconnect", at_s=(4.0,), lasts_s=1.5),))) as emulator:
        stream = Is900(emulator.name, on_event=events.append)
        until(stream, lambda frame: [event.kind for event in events].count("connected") == 2)
        assert len(list(islice(stream, 20))) == 20
        stream.close()
    assert [event.kind for event in events] == ["connected", "unplugged", "connected"]
    assert events[1].wall_s == pytest.approx(stream.wall_s(events[1].monotonic_s), abs=0.1)


@pytest.fixture
def nothing_left() -> Iterator[None]:
    """Check that no thread and no file descriptor is left."""

    def resources() -> tuple[set[threading.Thread], int]:
        return set(threading.enumerate()), len(os.listdir("/proc/self/fd"))

    if not os.path.isdir("/proc/self/fd"):
        pytest.skip("this system does not list open descriptors in /proc")
    before = resources()
    yield
    assert resources() == before


@pytest.mark.long
@pytest.mark.usefixtures("nothing_left")
def test_nothing_is_left_behind(serve: Serve) -> None:
    faults = (Fault("disconnect", at_s=(4.0,), lasts_s=0.3), Fault("reset", at_s=(6.0,)))
    with serve(EmulatorConfig(faults=faults)) as emulator:
        threads = threading.active_count()
        with Is900(emulator.name) as stream:
            until(stream, lambda frame: stream.counts["reconnects"] >= 2)
            assert stream.counts["reconnects"] >= 2
            assert threading.active_count() == threads
        for _ in range(3):
            Is900(emulator.name).close()
        with pytest.raises(BadInput):
            Is900(emulator.name, DriverConfig(stations=tuple("abcdefgh")))


@pytest.mark.usefixtures("nothing_left")
def test_another_thread_may_close_it_at_any_moment(serve: Serve) -> None:
    with serve() as emulator:
        stream = Is900(emulator.name)
        first, ended = threading.Event(), threading.Event()

        def read() -> None:
            for _ in stream:
                first.set()
            ended.set()

        reading = threading.Thread(target=read)
        reading.start()
        assert first.wait(TIMEOUT_S)
        stream.close()
        assert ended.wait(TIMEOUT_S)
        reading.join()
        assert not emulator.emulator.device.streaming
    stream.close()
    assert list(stream) == []


@pytest.mark.usefixtures("nothing_left")
def test_the_driver_can_be_closed_while_it_reconnects(serve: Serve) -> None:
    events: list[LineEvent] = []
    line_gone = threading.Event()

    def on_event(event: LineEvent) -> None:
        events.append(event)
        if event.kind == "unplugged":
            line_gone.set()

    with serve() as emulator:
        stream = Is900(emulator.name, on_event=on_event)
        next(iter(stream))
        reading = threading.Thread(target=lambda: list(stream))
        reading.start()
    assert line_gone.wait(TIMEOUT_S)
    stream.close()
    reading.join(TIMEOUT_S)
    assert not reading.is_alive()


CLIENT = """
import sys
from harness.stream.is900 import Is900
try:
    with Is900(sys.argv[1]) as stream:
        for frame in stream:
            print(frame.received_s, flush=True)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


def test_ctrl_c_leaves_the_device_quiet(tmp_path: Path) -> None:
    with serve_emulator(make_samples(2), pty=tmp_path / "is900") as emulator:
        client = subprocess.Popen(
            [sys.executable, "-c", CLIENT, emulator.name],
            stdout=subprocess.PIPE,
            text=True,
            preexec_fn=heeding_interrupts,
        )
        assert client.stdout is not None
        for _ in range(5):
            assert float(client.stdout.readline()) > 0.0
        client.send_signal(signal.SIGINT)
        output, _ = client.communicate(timeout=TIMEOUT_S)
        assert output.splitlines()[-1] == "interrupted"
        assert client.returncode == 0
        assert not emulator.emulator.device.streaming


def test_a_second_client_is_refused(serve: Serve) -> None:
    with serve() as emulator, Is900(emulator.name), pytest.raises(BadInput, match="another program"):
        Is900(emulator.name)


@pytest.mark.long
@pytest.mark.parametrize("baud", [9600, 57600])
def test_the_baud_rate_of_a_real_port_is_detected(baud: int, tmp_path: Path) -> None:
    config = EmulatorConfig(baud=baud, check_baud=True)
    with serve_emulator(make_samples(1, rate_hz=10.0), config, pty=tmp_path / "is900") as emulator:
        with Is900(emulator.name) as stream:
            assert stream.baud == baud
            assert len(list(islice(stream, 3))) == 3
        with pytest.raises(BadInput, match=r"at 19200 baud.*The baud rate may be wrong"):
            Is900(emulator.name, DriverConfig(baud=19200), timing=DriverTiming(answer_s=0.3))


def test_pausing_the_iteration_loses_no_frame(tmp_path: Path) -> None:
    with serve_emulator(make_samples(2), tcp="127.0.0.1:0") as emulator, Is900(emulator.name) as stream:
        frames = [frame for _ in range(10) for frame in islice(stream, 3)]
    periods = [round(50.0 * (b.measured_s[0] - a.measured_s[0])) for a, b in pairwise(frames)]
    assert set(periods) == {1}
