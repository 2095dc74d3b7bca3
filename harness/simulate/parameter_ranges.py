"""Range checks of the parameters of error components, with messages for the author of a scenario."""

import math

from harness.errors import BadInput


def require_ranges(component: object, **ranges: tuple[float, float]) -> None:
    """BadInput unless each named field lies within its range, bounds included; a pair must also be ascending."""
    for name, (low, high) in ranges.items():
        value = getattr(component, name)
        pair, kind = (value, "two ascending numbers") if isinstance(value, tuple) else ((value, value), "a number")
        if not (low <= pair[0] <= pair[1] <= high):
            what = f"{type(component).__name__}.{name} = {value}."
            wanted = f"from {low:g} to {high:g}" if math.isfinite(high) else f"{low:g} or more"
            raise BadInput(what, f"Give {kind} {wanted}.")
