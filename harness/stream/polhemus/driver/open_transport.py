"""Opens the line to a device by the name of its port."""

from harness.core.network import FASTRAK_PREFIX
from harness.errors import BadInput
from harness.stream.polhemus.driver.network_transport import open_network
from harness.stream.polhemus.driver.serial_transport import open_serial
from harness.stream.polhemus.driver.transport import Transport


def open_transport(port: str, baud: int = 115200) -> Transport:
    """Open `/dev/ttyUSB0`, `COM3`, a pty, `tcp://host:port`, `socket://host:port` or `udp://host:port`.

    `fastrak:` before any of them names the device there and opens the same.
    Raises BadInput when there is no such port or host, or when it is in use or may not be opened.
    """
    name = port.removeprefix(FASTRAK_PREFIX)
    if not name:
        advice = f"Write {port}/dev/ttyUSB0, {port}COM3 or {port}tcp://HOST:PORT."
        raise BadInput(f"Port {port!r}: no port is named.", advice)
    return open_network(name) if "://" in name else open_serial(name, baud)
