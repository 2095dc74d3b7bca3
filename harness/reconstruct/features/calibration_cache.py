"""What methods work out of their examples for trackers worn in one way, which takes seconds, is kept."""

from collections.abc import Callable
from typing import Generic, TypeVar

from harness.core.calibration import Calibration

T = TypeVar("T")


class CalibrationCache(Generic[T]):
    """Something made for the last calibration: sessions of one performer share it."""

    def __init__(self) -> None:
        self._kept: tuple[tuple[tuple[str, ...], bytes], T] | None = None

    def get(self, worn: Calibration, make: Callable[[], T]) -> T:
        """What `make` made when trackers were last worn otherwise; the one before is given up first."""
        key = tuple(worn.bones), worn.mount_m.tobytes()
        kept = self._kept
        if kept is None or kept[0] != key:
            kept = self._kept = None
            kept = self._kept = (key, make())
        return kept[1]
