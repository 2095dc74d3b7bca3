"""Robust fit of the registration model to the records of all stations, with its covariance.

The fit alternates three steps: readings that do not agree are left out, the noise of each station is fitted to what
remains, and generalised least squares gives the parameters. The covariance is that of the fitted noise; where blocks of
time longer than five correlation times scatter more than it says, it is enlarged.

The noise of an unknown source need not be of that kind. Plain least squares then weigh all readings alike, and only
those far from all others are left out. Orientations alone give rotations, time offset and clock; positions give the
rest. The covariance is the scatter of blocks, whose residuals are smaller than their errors where a block pulls the fit
to itself: by its leverage (Bell and McCaffrey 2002, bias reduced linearization).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from harness.core.arrays import Bools, Floats, Ints, find_runs
from harness.core.number_format import NORMAL_QUANTILE
from harness.measure.gauss_markov import ErrorProcess, fit_process
from harness.measure.pose_series import TruthSpline
from harness.measure.registration_model import CLOCK, OFFSET, OWN, SHARED, RegistrationState, linearise
from harness.measure.station_grid import StationGrid

OUTLIER, PLAIN_OUTLIER = 4.0, 20.0
"""Residuals of more robust deviations are left out; the second number is for orientations by plain least squares."""
BLOCK_CORRELATIONS = 5.0
"""Length of a block of the covariance, in correlation times."""
FEWEST_BLOCKS = 6
"""Blocks are shortened to have this many of them."""
_AXES = ((0, 1, 2), (3, 4), (5,))
"""Axes of a reading with one noise: position, pitch and roll, yaw."""
_CHI_MEDIAN = 1.538
"""Median length of a vector of three standard normal numbers."""
_REFITS = 3
"""Steps of generalised least squares, which is nearly linear."""
_LOOSE_ROWS = 20_000
"""About the most readings of a station for the first fit, which is only a start."""
_LEAST_REST = 0.01
"""Least share of a block's errors that is taken to be left in its residuals."""
_LONG_S, _AROUND_S = 0.4, 0.3
"""A run of outliers of this length is an excursion, whose ends are hidden in noise for this time [s]."""


StationNoise: TypeAlias = tuple[ErrorProcess, ErrorProcess, ErrorProcess]
"""Noise of position, pitch and roll, and yaw of a station."""


@dataclass(frozen=True, eq=False)
class FittedRegistration:
    """Parameters, their covariance, and what remains of the readings."""

    state: RegistrationState
    covariance: Floats
    """(11 + 6 S, 11 + 6 S) of the steps of `RegistrationState.moved`."""
    blocks: int
    """Number of blocks of time that the covariance rests on."""
    residuals: tuple[Floats, ...]
    """(N, 6) for each station: position [m] and rotation vector [rad]."""
    used: tuple[Bools, ...]
    """(N, 2) for each station: whether position and orientation were used."""
    noise: tuple[StationNoise, ...]
    """Position, pitch and roll, and yaw of each station."""


def fit_registration(
    grids: Sequence[StationGrid],
    truths: Sequence[TruthSpline],
    start: RegistrationState,
    fixed: Sequence[int] = (),
    *,
    plain: bool = False,
) -> FittedRegistration:
    """Fit all parameters of S stations but those `fixed`, from a start within some degrees and tenths of a second.

    `plain` is for sources of unknown noise: plain least squares instead of generalised ones.
    """
    state = _fit_loosely(grids, truths, start, fixed)
    for _ in range(2):
        residuals = refit_residuals(state, grids, truths)
        used = [_agreeing(r, g, PLAIN_OUTLIER if plain else OUTLIER) for r, g in zip(residuals, grids, strict=True)]
        noise = [_fit_noise(r, u, g.period_s) for r, u, g in zip(residuals, used, grids, strict=True)]
        for _ in range(_REFITS):
            step, sums = _whitened_step(state, grids, truths, used, noise, fixed, plain, by_block=True)
            state = state.moved(step)
    covariance = _plain_covariance(sums, fixed) if plain else _covariance(sums.information, sums.meat, fixed)
    if plain and CLOCK not in fixed:
        state, covariance = _move_reference(state, covariance, sums.information, fixed)
    residuals = refit_residuals(state, grids, truths)
    return FittedRegistration(state, covariance, sums.count, residuals, tuple(used), tuple(noise))


def refit_residuals(
    state: RegistrationState, grids: Sequence[StationGrid], truths: Sequence[TruthSpline]
) -> tuple[Floats, ...]:
    """(N, 6) residuals of each station under a state: position [m] and rotation vector [rad]."""
    return tuple(_spread(_linear(state, s, grids, truths)[0], grid.known) for s, grid in enumerate(grids))


def refit_steps(
    fit: FittedRegistration,
    grids: Sequence[StationGrid],
    truths: Sequence[TruthSpline],
    fixed: Sequence[int] = (),
    *,
    plain: bool = False,
) -> Floats:
    """Step (11 + 6 S,) from a fit to that with other references, by the readings and the noise of the fit."""
    state, total = fit.state, np.zeros(SHARED + OWN * len(grids))
    for _ in range(_REFITS):
        step, _ = _whitened_step(state, grids, truths, fit.used, fit.noise, fixed, plain)
        state, total = state.moved(step), total + step
    return total


def _linear(
    state: RegistrationState, s: int, grids: Sequence[StationGrid], truths: Sequence[TruthSpline]
) -> tuple[Floats, Floats]:
    """Residuals (K, 6) and slopes (K, 6, 17) of the K known readings of one station."""
    grid = grids[s]
    rows = grid.known
    return linearise(state, s, grid.measured_s[rows], grid.position_m[rows], grid.turn[rows], truths[s])


def _spread(values: Floats, known: Bools) -> Floats:
    """Values (K, ...) at the known places of a grid; zero elsewhere."""
    out = np.zeros((len(known), *values.shape[1:]))
    out[known] = values
    return out


def _thinned(grid: StationGrid) -> StationGrid:
    """A grid with some of its readings, evenly."""
    kept = np.zeros_like(grid.known)
    rows = np.flatnonzero(grid.known)
    kept[rows[:: max(len(rows) // _LOOSE_ROWS, 1)]] = True
    return replace(grid, known=kept)


def _columns(s: int) -> list[int]:
    """Places of the parameters of one station among all."""
    return [*range(SHARED), *range(SHARED + OWN * s, SHARED + OWN * (s + 1))]


def _fit_loosely(
    grids: Sequence[StationGrid], truths: Sequence[TruthSpline], state: RegistrationState, fixed: Sequence[int]
) -> RegistrationState:
    """Iteratively reweighted least squares with Tukey's weights, as if all records were independent."""
    size, grids = SHARED + OWN * len(grids), [_thinned(grid) for grid in grids]
    for _ in range(12):
        information, score = np.zeros((size, size)), np.zeros(size)
        for s in range(len(grids)):
            residual, slope = _linear(state, s, grids, truths)
            for part in (slice(0, 3), slice(3, 6)):
                length = np.linalg.norm(residual[:, part], axis=1)
                deviation = max(float(np.median(length)) / _CHI_MEDIAN, 1e-9)
                share = np.minimum(length / (6.0 * deviation), 1.0)
                weight = (1.0 - share**2) ** 2 / deviation**2
                rows = slope[:, part].reshape(-1, SHARED + OWN)
                weighted = rows * np.repeat(weight, 3)[:, None]
                place = np.ix_(_columns(s), _columns(s))
                information[place] += weighted.T @ rows
                score[_columns(s)] += weighted.T @ residual[:, part].reshape(-1)
        step = solve_normal(information, score, fixed)
        state = state.moved(step)
        if np.abs(step).max() < 1e-7:
            break
    return state


def _agreeing(residual: Floats, grid: StationGrid, most_turn: float = OUTLIER) -> Bools:
    """(N, 2) whether position and orientation agree with the model."""
    out = np.zeros((len(residual), 2), bool)
    for column, (part, limit) in enumerate(((slice(0, 3), OUTLIER), (slice(3, 6), most_turn))):
        length = np.linalg.norm(residual[:, part], axis=1)
        deviation = float(np.median(length[grid.known])) / _CHI_MEDIAN
        outlying = grid.known & (length > limit * deviation)
        near = outlying.copy()
        for begin, end in find_runs(_joined(outlying, grid.known)):
            around = round(_AROUND_S / grid.period_s) if (end - begin) * grid.period_s >= _LONG_S else 1
            near[max(begin - around, 0) : end + around] = True
        out[:, column] = grid.known & ~near
    return out


def _joined(outlying: Bools, known: Bools) -> Bools:
    """Outliers, where gaps between two of them count as well."""
    before = np.maximum.accumulate(np.where(known, np.arange(len(known)), -1))
    out: Bools = outlying | (~known & (before >= 0) & outlying[np.maximum(before, 0)])
    return out


def _fit_noise(residual: Floats, used: Bools, period_s: float) -> StationNoise:
    place, tilt, yaw = (
        fit_process(np.ascontiguousarray(residual[:, list(axes)]), used[:, int(axes[0] >= 3)], period_s)
        for axes in _AXES
    )
    return place, tilt, yaw


@dataclass(frozen=True, eq=False)
class _Block:
    """One block of time of one station, of whose parameters `columns` are the places."""

    columns: list[int]
    information: Floats
    """(17, 17)"""
    score: Floats
    """(17,) gradient of the squared errors."""


@dataclass(frozen=True, eq=False)
class _NormalSums:
    """Sums of least squares over all stations, P parameters."""

    information: Floats
    """(P, P) of the parameters that a reading is used for."""
    whole: Floats
    """(P, P) derivative of the score: for plain least squares with the slopes of positions by rotations and clocks."""
    blocks: tuple[_Block, ...]
    count: int
    """Number of blocks of time."""

    @property
    def meat(self) -> Floats:
        """(P, P) scatter of the gradients of blocks."""
        scores = np.zeros((len(self.blocks), len(self.information)))
        for row, block in zip(scores, self.blocks, strict=True):
            row[block.columns] = block.score
        out: Floats = scores.T @ scores * self.count / max(self.count - 1, 1)
        return out


def _whitened_step(
    state: RegistrationState,
    grids: Sequence[StationGrid],
    truths: Sequence[TruthSpline],
    used: Sequence[Bools],
    noise: Sequence[StationNoise],
    fixed: Sequence[int],
    plain: bool = False,
    *,
    by_block: bool = False,
) -> tuple[Floats, _NormalSums]:
    """One step of least squares, and its sums; without `by_block` those of blocks are left out."""
    size = SHARED + OWN * len(grids)
    information, whole, score = np.zeros((size, size)), np.zeros((size, size)), np.zeros(size)
    blocks, counts = list[_Block](), list[int]()
    for s, grid in enumerate(grids):
        residual, slope = _linear(state, s, grids, truths)
        places = np.flatnonzero(grid.known)
        if not plain:  # correlated noise needs every place of the grid
            residual, slope = _spread(residual, grid.known), _spread(slope, grid.known)
            places = np.arange(len(grid.known))
        own, rests, mine = list[Floats](), list[Floats](), np.ix_(_columns(s), _columns(s))
        weights = _alike(noise[s]) if plain else noise[s]
        for process, axes in zip(weights, _AXES, strict=True):
            valid = used[s][places, int(axes[0] >= 3)]
            for axis in axes:
                values = np.concatenate([slope[:, axis], residual[:, axis, None]], axis=1)
                white = process.whiten(values, valid, grid.period_s)
                rows, errors = white[:, :-1], white[:, -1]
                chosen = rows
                if plain and axis < 3:
                    chosen = rows.copy()
                    chosen[:, _BY_ORIENTATIONS] = 0.0
                information[mine] += chosen.T @ chosen
                whole[mine] += chosen.T @ rows
                score[_columns(s)] += chosen.T @ errors
                if by_block:
                    own.append(chosen)
                    rests.append(errors)
        if by_block:
            parts = _block_parts(grid, places, noise[s])
            slopes, errors = np.stack(own, axis=1), np.stack(rests, axis=1)
            for part in parts:
                rows = slopes[part].reshape(-1, SHARED + OWN)
                blocks.append(_Block(_columns(s), rows.T @ rows, rows.T @ errors[part].reshape(-1)))
            counts.append(len(parts))
    return solve_normal(whole, score, fixed), _NormalSums(information, whole, tuple(blocks), min(counts, default=0))


def _block_parts(grid: StationGrid, places: Ints, noise: StationNoise) -> list[slice]:
    """Rows of each block of time of one station, whose rows have these places (K,) of a grid."""
    longest_s, total = max(process.correlation_s for process in noise), len(grid.known)
    length = max(min(round(BLOCK_CORRELATIONS * longest_s / grid.period_s), total // FEWEST_BLOCKS), 1)
    edges = np.searchsorted(places, np.arange(0, total, length)).tolist()
    return [slice(begin, end) for begin, end in zip(edges, [*edges[1:], len(places)], strict=True)]


def _alike(noise: StationNoise) -> StationNoise:
    """White noise of the same size, and of one size about all axes: nothing says which one is vertical."""
    place, tilt, yaw = (math.hypot(one.white, one.drift) for one in noise)
    turn = ErrorProcess(math.sqrt((2.0 * tilt**2 + yaw**2) / 3.0), 0.0, 1.0)
    return ErrorProcess(place, 0.0, 1.0), turn, turn


_BY_ORIENTATIONS = [0, 1, 2, OFFSET, CLOCK]
"""Parameters that plain least squares find by orientations alone, of those on which positions depend."""


def _move_reference(
    state: RegistrationState, covariance: Floats, information: Floats, fixed: Sequence[int]
) -> tuple[RegistrationState, Floats]:
    """Move the time of the offset to where the clocks' rate does not change it: as one finds it without the rate."""
    free = _free(len(information), fixed)
    inverse = np.linalg.pinv(information[np.ix_(free, free)], rcond=1e-13)
    offset, clock = free.index(OFFSET), free.index(CLOCK)
    later_s = float(-inverse[offset, clock] / max(inverse[clock, clock], 1e-300))
    moved = np.array(covariance)
    moved[OFFSET] += later_s * moved[CLOCK]
    moved[:, OFFSET] += later_s * moved[:, CLOCK]
    at_s, offset_s = state.reference_s + later_s, state.offset_s + later_s * state.clock_ratio
    return replace(state, reference_s=at_s, offset_s=offset_s), moved


def _plain_covariance(sums: _NormalSums, fixed: Sequence[int]) -> Floats:
    """Scatter of the estimates over blocks, with Student's t for their number; fixed parameters have none.

    An error of what orientations give moves what positions give: the matrix of the equations is block triangular.
    """
    from scipy import special

    free = _free(len(sums.information), fixed)
    inverse, alone = _inverse(sums.whole, free), _inverse(sums.information, free)
    moves = np.array([inverse[:, block.columns] @ _corrected_score(block, alone, fixed) for block in sums.blocks])
    sandwich = moves.T @ moves
    least = np.diag(_covariance(sums.information, np.zeros_like(inverse), fixed))
    factor = np.sqrt(np.maximum(least / np.maximum(np.diag(sandwich), 1e-300), 1.0))
    student = float(special.stdtrit(max(sums.count - 1, 1), 0.975)) / NORMAL_QUANTILE
    out: Floats = sandwich * factor[:, None] * factor * student**2
    return out


def _inverse(matrix: Floats, free: Sequence[int]) -> Floats:
    """Pseudoinverse of the rows and columns of free parameters; zero elsewhere."""
    inside, out = np.ix_(free, free), np.zeros_like(matrix)
    scale = np.sqrt(np.maximum(np.diag(matrix)[free], 1e-300))
    out[inside] = np.linalg.pinv(matrix[inside] / scale[:, None] / scale, rcond=1e-12) / scale[:, None] / scale
    return out


def _corrected_score(block: _Block, inverse: Floats, fixed: Sequence[int]) -> Floats:
    """(17,) score of a block without the share of its errors that the fit took to itself.

    With independent errors of equal size the scatter of such scores has no bias.
    """
    rows = [row for row, column in enumerate(block.columns) if column not in fixed]
    columns = [block.columns[row] for row in rows]
    variance, axes = np.linalg.eigh(inverse[np.ix_(columns, columns)])
    root = axes * np.sqrt(np.maximum(variance, 1e-15 * variance[-1]))
    leverage, turn = np.linalg.eigh(root.T @ block.information[np.ix_(rows, rows)] @ root)
    base, out = root @ turn, block.score.copy()
    out[rows] = np.linalg.solve(base.T, base.T @ out[rows] / np.sqrt(np.maximum(1.0 - leverage, _LEAST_REST)))
    return out


def _free(size: int, fixed: Sequence[int]) -> list[int]:
    return [i for i in range(size) if i not in fixed]


def solve_normal(information: Floats, score: Floats, fixed: Sequence[int]) -> Floats:
    """Solution of the normal equations; parameters without information, and fixed ones, do not move."""
    out: Floats = _inverse(information, _free(len(score), fixed)) @ score
    return out


def _covariance(information: Floats, meat: Floats, fixed: Sequence[int]) -> Floats:
    """Inverse of the information, enlarged where blocks scatter more; fixed parameters have none."""
    free = _free(len(information), fixed)
    inside = np.ix_(free, free)
    scale = np.sqrt(np.maximum(np.diag(information)[free], 1e-300))
    curvature, directions = np.linalg.eigh(information[inside] / scale[:, None] / scale)
    # A direction that nothing shows keeps a variance, which is then too large to pass.
    inverse = (directions / np.maximum(curvature, 1e-13)) @ directions.T / scale[:, None] / scale
    sandwich = inverse @ meat[inside] @ inverse
    factor = np.sqrt(np.maximum(np.diag(sandwich) / np.maximum(np.diag(inverse), 1e-300), 1.0))
    out = np.zeros_like(information)
    out[inside] = inverse * factor[:, None] * factor
    return out
