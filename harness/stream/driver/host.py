"""What the driver needs of the computer it runs on; a test puts its own in, where hours pass at once."""

import time
from collections.abc import Callable
from dataclasses import dataclass

from harness.stream.driver.transport import Transport, open_transport


@dataclass(frozen=True)
class Host:
    """Ports and clocks."""

    open: Callable[[str, int], Transport] = open_transport
    """Port and baud to a line; BadInput."""
    monotonic_s: Callable[[], float] = time.monotonic
    wall_s: Callable[[], float] = time.time
    sleep: Callable[[float], None] = time.sleep
