"""Cache of what a method computes for a calibration, such as the features of its examples, which takes seconds."""

from collections.abc import Callable
from typing import Generic, TypeVar

from harness.core.calibration import Calibration

T = TypeVar("T")


class CalibrationCache(Generic[T]):
    """Holds a value for the last calibration, so that sessions of one performer share it."""

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
