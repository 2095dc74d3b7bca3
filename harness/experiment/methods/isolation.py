"""Isolation of methods: which ones run in processes of their own, and the limits of time and memory there."""

import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

DEFAULT_TIME_LIMIT_S = 600.0
"""Longest time that a method may take for its training, and for one take [s]."""
_MEMORY_SHARE = 0.8
"""Share of the machine's memory that all methods together may use by default."""


@dataclass(frozen=True)
class Isolation:
    """Which methods run in processes of their own, and their limits."""

    every_method: bool = False
    """Also the methods of this package; those from outside always do."""
    time_limit_s: float = DEFAULT_TIME_LIMIT_S
    """Longest time for training, and for one take [s]."""
    memory_limit_gb: float | None = None
    """Largest memory of one method [GB]; by default 0.8 of the machine's, divided by the number of workers."""
    workers: int = 1
    """Number of workers that share the machine."""

    @property
    def memory_bytes(self) -> int:
        """Largest memory of one method [bytes]."""
        if self.memory_limit_gb is not None:
            return int(self.memory_limit_gb * 1e9)
        return int(_MEMORY_SHARE * machine_memory_bytes() / self.workers)


def machine_memory_bytes() -> int:
    """Memory of this machine, or of the control group that this process may use [bytes]."""
    sizes = [os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")] if hasattr(os, "sysconf") else [1 << 34]
    with suppress(OSError, ValueError):
        sizes.append(int(Path("/sys/fs/cgroup/memory.max").read_text(encoding="ascii")))
    return min(sizes)


DEFAULT_ISOLATION = Isolation()
"""Methods from outside the package in processes of their own, with the default limits."""
