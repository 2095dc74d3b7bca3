"""The score of a method on a capture that was registered with a reference."""

from dataclasses import dataclass


@dataclass(frozen=True)
class ReconstructionScore:
    """One metric of one method."""

    method: str
    metric: str
    value: float | None
    """Mean over the frames, in the metric's unit; None if it was not measured."""
    failure: str = ""
    """Why the method has no result, as for a failed cell; "" if it has one."""
