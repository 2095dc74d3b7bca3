"""What the parameters of an error component may be, so that a slip in a scenario is refused in words."""

import math

from harness.errors import BadInput


def require_ranges(component: object, **ranges: tuple[float, float]) -> None:
    """Each named field lies between these two, bounds included; of a pair both, in ascending order. Else BadInput."""
    for name, (low, high) in ranges.items():
        value = getattr(component, name)
        pair, kind = (value, "two ascending numbers") if isinstance(value, tuple) else ((value, value), "a number")
        if not (low <= pair[0] <= pair[1] <= high):
            what = f"{type(component).__name__}.{name} = {value}."
            wanted = f"from {low:g} to {high:g}" if math.isfinite(high) else f"{low:g} or more"
            raise BadInput(what, f"Give {kind} {wanted}.")
