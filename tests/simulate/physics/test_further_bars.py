"""`hall` goes on below long walks, in its own pattern."""

import numpy as np
import pytest

from harness.core.arrays import Floats
from harness.errors import BadInput
from harness.simulate.physics.constellation import ConstellationSettings, load_constellation
from harness.simulate.physics.further_bars import MARGIN_M, MOST, SHIPPED, STEP_M, further_bars
from harness.stream.polhemus.codec import Emitter

HALL = ConstellationSettings(name="hall")


def reaching(columns: float, rows: float) -> tuple[float, float]:
    """Half of a path that just fits below so many columns and rows of bars [m]."""
    return columns * STEP_M[0] / 2 - MARGIN_M, rows * STEP_M[1] / 2 - MARGIN_M


def bars(emitters: tuple[Emitter, ...]) -> dict[tuple[float, float], Floats]:
    """From an emitter of a bar to the next (2, 3) [m], by the place of the bar's middle in steps."""
    by_bar = np.array([e.position_m for e in sorted(emitters, key=lambda e: e.identity)]).reshape(-1, 3, 3)
    places = np.round(2.0 * by_bar[:, 1, :2] / STEP_M) / 2.0
    return {(x, y): np.diff(bar, axis=0) for (x, y), bar in zip(places.tolist(), by_bar, strict=True)}


def test_a_path_below_the_shipped_bars_needs_no_more() -> None:
    assert further_bars(reaching(*SHIPPED)) == ()
    assert len(load_constellation(HALL, reaching(*SHIPPED))) == 36


@pytest.mark.parametrize(("more_m", "columns", "rows"), [((0.01, 0.0), 6, 3), ((0.0, 0.01), 4, 5), ((2.5, 3.1), 8, 7)])
def test_columns_and_rows_grow_on_both_sides(more_m: tuple[float, float], columns: int, rows: int) -> None:
    half_m = np.add(reaching(*SHIPPED), more_m)
    hall = load_constellation(HALL, (float(half_m[0]), float(half_m[1])))
    assert len(hall) == 3 * columns * rows
    found = bars(hall.emitters)
    assert set(found) == {(c - (columns - 1) / 2, r - (rows - 1) / 2) for c in range(columns) for r in range(rows)}
    for (x, y), steps_m in found.items():
        along = np.roll([0.9144, 0.0, 0.0], round(x + y + 2.5) % 2)  # bars along x and along y alternate
        np.testing.assert_allclose(steps_m, [along, along], atol=1e-9)


def test_an_emitter_has_its_number_in_every_take() -> None:
    numbers = [{e.number: e.position_m for e in further_bars(reaching(*size))} for size in ((8, 5), (12, 13))]
    assert numbers[0].items() < numbers[1].items()
    assert min(numbers[1]) == 37
    assert len(numbers[1]) == 3 * (MOST[0] * MOST[1] - SHIPPED[0] * SHIPPED[1])


@pytest.mark.parametrize("size", [(12.1, 3), (4, 13.1)])
def test_a_path_that_is_too_long_is_refused(size: tuple[float, float]) -> None:
    with pytest.raises(BadInput, match="`hall` has at most 29 m by 40 m"):
        further_bars(reaching(*size))


def test_other_constellations_do_not_grow() -> None:
    assert len(load_constellation(ConstellationSettings(name="cave"), (20.0, 20.0))) == 9
    own = ConstellationSettings(name="hall", emitters=load_constellation(HALL).emitters[:5])
    assert len(load_constellation(own, (10.0, 10.0))) == 5
