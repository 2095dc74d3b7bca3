"""One line of `harness bench`: what was measured, beside what it is held to."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """A figure of one run; figures of different runs or machines are compared through `reference` only."""

    name: str
    """What was measured, such as "ik, six trackers, converged"."""
    value: float
    """The figure itself, in `unit`."""
    unit: str
    """Such as "frames/s"."""
    reference: str
    """What it was measured against in the same run, or "" when it stands alone."""
    target: str
    """What it is held to, such as ">= 1500"; "" when it is for information."""
