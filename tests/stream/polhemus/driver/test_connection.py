"""Waits of the exchange with a device, on a clock that only reads advance."""

import pytest

from harness.stream.line_events import NullLineObserver
from harness.stream.polhemus.driver.config import DriverTiming
from harness.stream.polhemus.driver.connection import DeviceConnection, Host

START_S, QUIET_S = 500.0, 0.1


class SilentLine:
    """A transport on which bytes arrive at given times only."""

    name = "silent"

    def __init__(self, *arrivals_s: float) -> None:
        self.now_s, self._arrivals_s = START_S, [START_S + at_s for at_s in arrivals_s]

    def read(self, timeout_s: float) -> bytes:
        if self._arrivals_s and self._arrivals_s[0] <= self.now_s + timeout_s:
            self.now_s = self._arrivals_s.pop(0)
            return b"x"
        self.now_s += timeout_s
        return b""

    def write(self, data: bytes) -> None: ...

    def close(self) -> None: ...


def connection(line: SilentLine) -> DeviceConnection:
    host = Host(monotonic_s=lambda: line.now_s, wall_s=lambda: line.now_s)
    return DeviceConnection(line, host, NullLineObserver(), DriverTiming(quiet_s=QUIET_S, poll_s=60.0))


@pytest.mark.parametrize(("arrivals_s", "after_s"), [((), 0.1), ((0.04,), 0.14), ((0.04, 0.12), 0.22)])
def test_silence_is_waited_for_no_longer_than_needed(arrivals_s: tuple[float, ...], after_s: float) -> None:
    """It lasts `quiet_s` from the last byte."""
    line = SilentLine(*arrivals_s)
    assert connection(line).wait_for_silence()
    assert line.now_s - START_S == pytest.approx(after_s)


def test_a_device_that_sends_on_is_given_up_after_ten_times_as_long() -> None:
    line = SilentLine(*(0.05 * n for n in range(1, 100)))
    assert not connection(line).wait_for_silence()
    assert line.now_s - START_S == pytest.approx(1.05)


def test_listening_lasts_as_long_as_it_is_told() -> None:
    line = SilentLine(0.2, 0.5, 1.5)
    assert connection(line).listen(1.0) == b"xx"
    assert line.now_s - START_S == pytest.approx(1.0)
