"""What trained methods keep: how a session starts, and what was computed for a calibration."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from harness.core.calibration import Calibration
from harness.reconstruct.contract import Session

T = TypeVar("T")
S = TypeVar("S", bound=Session, covariant=True)


@dataclass(frozen=True, eq=False)
class Fitted(Generic[S]):
    """A `Reconstructor` that knows no more than what its sessions start with."""

    begin: Callable[[Calibration], S]


class CalibrationCache(Generic[T]):
    """Cache of what takes seconds, such as the features of the examples.

    It holds a value for the last calibration, so that sessions of one performer share it.
    """

    def __init__(self) -> None:
        self._entry: tuple[tuple[tuple[str, ...], bytes], T] | None = None

    def get(self, calibration: Calibration, make: Callable[[], T]) -> T:
        """The value for a calibration's bones and mounts; `make` is called when they changed.

        The old value is released first, since both may not fit into memory.
        """
        key = tuple(calibration.bones), calibration.mount_m.tobytes()
        entry = self._entry
        if entry is None or entry[0] != key:
            entry = self._entry = None
            entry = self._entry = (key, make())
        return entry[1]
