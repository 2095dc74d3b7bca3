"""Patterns of the buttons and the joystick of an emulated station (items 22 and 23)."""

from collections.abc import Callable

import numpy as np

from harness.core.arrays import Floats, Ints
from harness.errors import BadInput

PERIOD_S = 8.0
"""Duration of a cycle [s]."""
BUTTON_BITS = 6
"""Buttons 1 to 4, the pressed joystick and the trigger have bits 0 to 5 (docs/is900.md 5.1)."""
CENTRE, SWING = 127, 128
"""Joystick value at rest, and its greatest distance from there; the extremes are cut to 0 and 255."""

ControlPattern = Callable[[Floats], tuple[Ints, Ints]]
"""Converts times (N,) [s] to button bits (N,) and joystick values (N, 2), left to right and rear to front."""


def _still(time_s: Floats) -> tuple[Ints, Ints]:
    """Press nothing and leave the joystick at its centre."""
    return np.zeros(len(time_s), np.int64), np.full((len(time_s), 2), CENTRE)


def _cycle(time_s: Floats) -> tuple[Ints, Ints]:
    """Press each button for a second in turn, and none for two. Move the joystick sideways, then back and forth."""
    phase_s = time_s % PERIOD_S
    pressed = phase_s.astype(np.int64)
    buttons = np.where(pressed < BUTTON_BITS, 1 << pressed, 0)
    swing = SWING * np.sin(2.0 * np.pi * phase_s / (0.5 * PERIOD_S))
    sideways = phase_s < 0.5 * PERIOD_S
    offset = np.stack([np.where(sideways, swing, 0.0), np.where(sideways, 0.0, swing)], axis=-1)
    return buttons, np.clip(np.rint(CENTRE + offset), 0, 255).astype(np.int64)


CONTROL_PATTERNS: dict[str, ControlPattern] = {"cycle": _cycle, "still": _still}
"""Patterns by name."""


def check_control_pattern(name: str) -> None:
    """Raise BadInput unless there is a pattern of this name."""
    if name not in CONTROL_PATTERNS:
        raise BadInput(f"controls {name!r} are not known.", f"Use {' or '.join(CONTROL_PATTERNS)}.")
