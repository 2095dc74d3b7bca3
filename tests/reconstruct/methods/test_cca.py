"""Kernel CCA against the eigenproblem as printed, and against regressions with a known solution."""

import numpy as np
import pytest
import scipy.linalg
import scipy.spatial

from harness.core.arrays import Floats
from harness.reconstruct.methods import cca

PAIRS, KAPPA = 14, 1e-2


def canonical_correlations(inputs: Floats, outputs: Floats, *, bases: int, kappa: float) -> Floats:
    """The largest canonical correlations (l,) of two Gram matrices (m, m), in descending order."""
    squared, _, _ = cca._canonical_bases(cca._centre(inputs), cca._centre(outputs), bases, kappa)
    out: Floats = np.sqrt(np.maximum(squared[::-1], 0.0))
    return out


def planted(rng: np.random.Generator) -> tuple[Floats, Floats, Floats]:
    """Inputs (m, 7), outputs (m, 5) that depend on them with noise, and a new input (7,)."""
    x = rng.normal(size=(PAIRS, 7))
    y = np.tanh(x @ rng.normal(size=(7, 5))) + 0.1 * rng.normal(size=(PAIRS, 5))
    return x, y, 0.5 * rng.normal(size=7)


def grams(x: Floats, y: Floats, new: Floats, width: float = 0.7) -> tuple[Floats, Floats, Floats]:
    """Gaussian kernels of both sides (docs/papers.md E), and the query's."""
    sharpness = [0.5 / (width**2 * scipy.spatial.distance.pdist(side, "sqeuclidean").mean()) for side in (x, y)]
    far = [np.sum((side[:, None] - side) ** 2, axis=2) for side in (x, y)]
    kernels = [np.exp(-sharp * squared) for sharp, squared in zip(sharpness, far, strict=True)]
    return kernels[0], kernels[1], np.exp(-sharpness[0] * np.sum((x - new) ** 2, axis=1))


def as_written(h: Floats, f: Floats, k: Floats, y: Floats, bases: int, held: bool) -> tuple[Floats, Floats]:
    """Correlations (l,) and prediction of eq. 3 to 5, as one generalised symmetric eigenproblem on both blocks."""
    within = scipy.linalg.null_space(np.ones((1, PAIRS)))
    n = PAIRS - 1
    centred_h, centred_f = within.T @ h @ within, within.T @ f @ within
    ridge_h, ridge_f = (KAPPA * np.trace(g) / n * np.eye(n) for g in (centred_h, centred_f))
    nothing = np.zeros((n, n))
    values, vectors = scipy.linalg.eigh(
        np.block([[nothing, centred_h @ centred_f], [centred_f @ centred_h, nothing]]),
        np.block([[centred_h @ (centred_h + ridge_h), nothing], [nothing, centred_f @ (centred_f + ridge_f)]]),
    )
    best = vectors[:, ::-1][:, :bases]
    reduced_x, reduced_y = within @ centred_h @ best[:n], within @ centred_f @ best[n:]
    square = best[:n].T @ centred_h @ (centred_h + held * ridge_h) @ best[:n]
    first = np.linalg.solve(square, reduced_x.T @ reduced_y)  # eq. 4
    second = np.linalg.lstsq(reduced_y, y - y.mean(axis=0))[0]  # eq. 5
    new = (k - h.mean(axis=1)) @ within @ best[:n]
    return values[::-1][:bases], y.mean(axis=0) + new @ first @ second


@pytest.mark.parametrize("held", [False, True])
def test_correlations_and_answer_are_those_of_the_problem_as_written(rng: np.random.Generator, held: bool) -> None:
    x, y, new = planted(rng)
    h, f, k = grams(x, y, new)
    correlations, answer = as_written(h, f, k, y, 6, held)
    np.testing.assert_allclose(canonical_correlations(h, f, bases=6, kappa=KAPPA), correlations, atol=1e-9)
    np.testing.assert_allclose(cca.weights_from_kernels(h, f, k, 6, KAPPA, held) @ y, answer, atol=1e-9)


def test_a_planted_linear_system_comes_back(rng: np.random.Generator) -> None:
    x, new = rng.normal(size=(PAIRS, 4)), rng.normal(size=4)
    linear, offset = rng.normal(size=(4, 6)), rng.normal(size=6)
    y = x @ linear + offset
    weights = cca.weights_from_kernels(x @ x.T, y @ y.T, x @ new, 4, KAPPA, False)
    np.testing.assert_allclose(weights @ y, new @ linear + offset, atol=1e-9)


def test_weights_sum_to_one_and_unite_at_an_example_when_nothing_is_held_back(rng: np.random.Generator) -> None:
    x, y, _ = planted(rng)
    h, f, k = grams(x, y, x[3])
    np.testing.assert_allclose(cca.weights_from_kernels(h, f, k, 3, KAPPA, True).sum(), 1.0, atol=1e-12)
    np.testing.assert_allclose(cca.weights_from_kernels(h, f, k, PAIRS, 1e-13, True), np.eye(PAIRS)[3], atol=1e-9)


def test_without_regularisation_every_direction_correlates_fully(rng: np.random.Generator) -> None:
    x, y, new = planted(rng)
    h, f, _ = grams(x, y, new)
    np.testing.assert_allclose(canonical_correlations(h, f, bases=PAIRS, kappa=1e-13), 1.0, atol=1e-9)
    assert canonical_correlations(h, f, bases=PAIRS, kappa=KAPPA)[-1] < 0.9


def test_two_pairs_are_enough() -> None:
    gram = np.array([[1.0, 0.2], [0.2, 1.0]])
    weights = cca.weights_from_kernels(gram, gram, np.array([1.0, 0.2]), 6, 1e-13, True)
    np.testing.assert_allclose(weights, [1.0, 0.0], atol=1e-9)


def test_pairs_that_are_the_same_are_refused() -> None:
    with pytest.raises(ArithmeticError, match="same"):
        cca.weights_from_kernels(np.ones((3, 3)), np.eye(3), np.ones(3), 2, KAPPA, True)


def test_distances_are_pairwise(rng: np.random.Generator) -> None:
    x = rng.normal(size=(5, 3))
    expected = np.sum((x[:, None] - x) ** 2, axis=2)
    np.testing.assert_allclose(cca.squared_distances(x), expected, atol=1e-12)


def test_the_whole_regression_is_that_of_its_kernels(rng: np.random.Generator) -> None:
    x, y, new = planted(rng)
    h, f, k = grams(x, y, new)
    expected = cca.weights_from_kernels(h, f, k, 6, KAPPA, True)
    found = cca.regression_weights(x, new, y, 0.7, 6, KAPPA, True)
    np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize("size", [1, 2, 3, 24])
def test_eigenvectors_are_those_of_the_matrix(rng: np.random.Generator, size: int) -> None:
    half = rng.normal(size=(size, max(size // 2, 1)))  # half of the values are 0
    matrix = half @ half.T
    values, rows = cca.symmetric_eigen(matrix.copy())
    np.testing.assert_allclose(np.sort(values), np.linalg.eigvalsh(matrix), atol=1e-12)
    np.testing.assert_allclose(rows @ rows.T, np.eye(size), atol=1e-12)
    np.testing.assert_allclose((rows.T * values) @ rows, matrix, atol=1e-12)


@pytest.mark.parametrize("size", [2, 12, 20, 24, 31])
@pytest.mark.parametrize("value", [0.0, 1e-200, 0.3, 1.0])
def test_eigenvectors_of_next_to_nothing_are_numbers(size: int, value: float) -> None:
    """Reflections of a matrix of rank 1 leave elements whose squares underflow."""
    values, rows = cca.symmetric_eigen(np.full((size, size), value))
    np.testing.assert_allclose(np.sort(values)[-1], size * value, rtol=1e-9, atol=1e-140)
    np.testing.assert_allclose(rows @ rows.T, np.eye(size), atol=1e-9)
