"""What the driver needs from its computer: ports and clocks. Tests replace it with a simulated one."""

import time
from collections.abc import Callable
from dataclasses import dataclass

from harness.stream.driver.transport import Transport, open_transport


@dataclass(frozen=True)
class Host:
    """Ports and clocks of the computer that the driver runs on."""

    open: Callable[[str, int], Transport] = open_transport
    """Opens a port at a baud rate. Raises BadInput."""
    monotonic_s: Callable[[], float] = time.monotonic
    wall_s: Callable[[], float] = time.time
    sleep: Callable[[float], None] = time.sleep
