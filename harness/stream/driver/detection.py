"""Detection of the device: find the baud rate of the port, and check that an IS-900 answers."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from harness.errors import BadInput
from harness.stream.codec.commands import STATUS
from harness.stream.codec.items import BAUD_RATES
from harness.stream.codec.replies import StatusRecord
from harness.stream.driver.config import DriverConfig
from harness.stream.driver.connection import WAKE_UP, DeviceConnection
from harness.stream.driver.transport import LineLost


class NoAnswer(BadInput):
    """No reply of an IS-900 came over the line."""


@dataclass(frozen=True)
class DetectedDevice:
    """A device that answered."""

    line: DeviceConnection
    baud: int | None
    """Baud rate of the port [bit/s]; None over TCP, where there is no such limit."""
    status: StatusRecord


def candidate_baud_rates(port: str, config: DriverConfig) -> Sequence[int | None]:
    """Return the baud rates to try on this port; (None,) over TCP."""
    if "://" in port:
        return (None,)
    return BAUD_RATES if config.baud is None else (config.baud,)


def detect_device(
    port: str, bauds: Sequence[int | None], connect: Callable[[int | None], DeviceConnection], answer_s: float
) -> DetectedDevice:
    """Open the port at one baud rate after another until an IS-900 answers. Raises BadInput when none does."""
    total_bytes = 0
    for baud in bauds:
        line = connect(baud)
        try:
            status = query_status(line, answer_s)
            if status is not None:
                _check_kind(port, status)
                return DetectedDevice(line, baud, status)
            total_bytes += line.received_bytes
        except LineLost as lost:
            line.transport.close()
            raise NoAnswer(
                f"Port {port}: {lost.why}, before the device answered.", "Is another program connected to it?"
            ) from lost
        except BaseException:
            line.transport.close()
            raise
        line.transport.close()
    raise _no_answer_error(port, bauds, total_bytes)


def query_status(line: DeviceConnection, answer_s: float) -> StatusRecord | None:
    """Stop the device and return its reply to `S`; None when it does not stop or does not answer."""
    if not line.stop(WAKE_UP):
        return None
    status = line.ask(STATUS, StatusRecord, answer_s)
    if status is None and line.received_bytes:
        line.wait_for_silence()
        status = line.ask(b"\r" + STATUS, StatusRecord, answer_s)
    return status


def _check_kind(port: str, status: StatusRecord) -> None:
    if "IS900" not in re.sub("[- ]", "", status.identification.upper()):
        raise BadInput(
            f"Port {port}: the device {status.identification.strip()!r}, firmware {status.firmware}, is no IS-900.",
            "Name the port of an IS-900.",
        )


def _no_answer_error(port: str, bauds: Sequence[int | None], received_bytes: int) -> NoAnswer:
    rates = " at " + ", ".join(map(str, bauds)) + " baud" if bauds[0] else ""
    advice = "The baud rate may be wrong: omit it, and each is tried. " if bauds[0] and len(bauds) == 1 else ""
    if received_bytes == 0:
        return NoAnswer(
            f"Port {port}: nothing answers{rates}.",
            f"{advice}Is the device on and started (up to 20 s), the cable that of the device, and this its port?",
        )
    return NoAnswer(
        f"Port {port}: {received_bytes} bytes arrived{rates}, but no reply of an IS-900.",
        advice.strip() or "Another device may be at this port, or the cable is bad. Name the port of an IS-900.",
    )
