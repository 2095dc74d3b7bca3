"""Find the device: which rate the port speaks, and whether it is an IS-900 that answers."""

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
    """Nothing that an IS-900 says came over the line."""


@dataclass(frozen=True)
class DetectedDevice:
    """A device that answered."""

    line: DeviceConnection
    baud: int | None
    """Of the port [bit/s]; None where bytes go as fast as they can, over TCP."""
    status: StatusRecord


def candidate_baud_rates(port: str, wanted: DriverConfig) -> Sequence[int | None]:
    """The rates to try on this port."""
    if "://" in port:
        return (None,)
    return BAUD_RATES if wanted.baud is None else (wanted.baud,)


def detect_device(
    port: str, bauds: Sequence[int | None], connect: Callable[[int | None], DeviceConnection], answer_s: float
) -> DetectedDevice:
    """Open the port at one rate after another, until an IS-900 answers; BadInput when none does."""
    heard = 0
    for baud in bauds:
        line = connect(baud)
        try:
            status = query_status(line, answer_s)
            if status is not None:
                _check_kind(port, status)
                return DetectedDevice(line, baud, status)
            heard += line.received_bytes
        except LineLost as lost:
            line.transport.close()
            raise NoAnswer(
                f"Port {port}: {lost.why}, before the device answered.", "Is another program connected to it?"
            ) from lost
        except BaseException:
            line.transport.close()
            raise
        line.transport.close()
    raise _no_answer_error(port, bauds, heard)


def query_status(line: DeviceConnection, answer_s: float) -> StatusRecord | None:
    """The device's answer to `S`, once it is silent."""
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
            f"Port {port}: {status.identification.strip()!r}, firmware {status.firmware}, answers, which is no IS-900.",
            "Name the port of an IS-900.",
        )


def _no_answer_error(port: str, bauds: Sequence[int | None], heard: int) -> NoAnswer:
    rates = " at " + ", ".join(map(str, bauds)) + " baud" if bauds[0] else ""
    one_rate = "The rate may be wrong: leave it out, and each is tried. " if bauds[0] and len(bauds) == 1 else ""
    if heard == 0:
        return NoAnswer(
            f"Port {port}: nothing answers{rates}.",
            f"{one_rate}Is the device on and has it started (up to 20 s), the cable a null modem, and this its port?",
        )
    return NoAnswer(
        f"Port {port}: {heard} bytes came{rates}, but no answer of an IS-900.",
        one_rate.strip() or "Something else may be at this port, or the cable is bad. Name the port of an IS-900.",
    )
