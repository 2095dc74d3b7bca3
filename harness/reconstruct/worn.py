"""What methods work out of their examples for trackers worn in one way, which takes seconds, is kept."""

from collections.abc import Callable
from typing import Generic, TypeVar

from harness.core.calibration import Calibration

T = TypeVar("T")


class WhileWorn(Generic[T]):
    """Something made for the last calibration: sessions of one performer share it."""

    def __init__(self) -> None:
        self._key: tuple[tuple[str, ...], bytes] | None = None
        self._kept: list[T] = []

    def get(self, worn: Calibration, make: Callable[[], T]) -> T:
        """What `make` made when trackers were last worn otherwise; the one before is given up first."""
        key = tuple(worn.bones), worn.mount_m.tobytes()
        if key != self._key:
            self._key = None
            self._kept.clear()
            self._kept.append(make())
            self._key = key
        return self._kept[0]
