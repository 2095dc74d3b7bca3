"""Tabulated moments of examples, from which a local Gaussian is put together without touching the examples.

Pairs (f, y) of features and targets are clustered by f. For each cell the table holds the count, the mean and the
scatter of its pairs. A weighted mean of neighbouring cells has the moments of the weighted examples in them, up to
weights that are constant within a cell. So a local regression costs a few dozen cells instead of hundreds of examples,
needs no search index, and costs the same for any number of examples.

Locally weighted regression from sufficient statistics: Atkeson, Moore and Schaal 1997, section 3; the conditional
Gaussian with noisy inputs is the linear minimum mean square error estimator (Kay 1993, eq. 12.6).
"""

import math
from typing import NamedTuple, Protocol

import numpy as np

from harness.core.arrays import Floats, Ints, Singles
from harness.core.compiled import compiled
from harness.core.seeds import generator
from harness.reconstruct.index.decomposition import cluster_vectors

MAX_CELLS = 448
"""Largest number of cells: with 32 features and 52 targets a table then takes 6.6 MB."""
EXAMPLES_PER_CELL = 50
"""Mean number of examples in a cell, while there are few."""
_TINY = 1e-12


class MomentTable(NamedTuple):
    """Moments of D = F + Y numbers, features first, in C cells."""

    features: int
    """F."""
    examples: Floats
    """(C,) number of examples."""
    mean: Singles
    """(C, D) mean of each cell."""
    scatter: Singles
    """(C, D (D + 1) / 2) sum of products of differences from the mean: the lower triangle, row by row."""
    spread: Floats
    """(C,) mean squared distance of a cell's features from their mean."""


class LocalGaussian(NamedTuple):
    """Moments of the examples near a query."""

    mean: Floats
    """(D,) weighted mean."""
    covariance: Floats
    """(D, D) weighted covariance, lower triangle."""


class Targets(Protocol):
    """Targets of N examples: an array (N, Y), or anything else that is indexed by rows."""

    def __getitem__(self, rows: Ints, /) -> Singles:
        """(K, Y) targets of these rows (K,)."""
        ...


def tabulate_moments(features: Singles, targets: Targets) -> MomentTable:
    """The table of N examples with features (N, F) and targets (N, Y)."""
    total, size = features.shape
    cell = cluster_vectors(features, cells_for(total), generator(0, "moment table", total))
    order = np.argsort(cell, kind="stable")
    counts = np.bincount(cell)
    counts = counts[counts > 0]
    lower = np.tril_indices(size + targets[order[:1]].shape[1])
    means, spread = np.empty((len(counts), lower[0][-1] + 1), np.float32), np.empty(len(counts))
    scatters = np.empty((len(counts), len(lower[0])), np.float32)
    for c, members in enumerate(np.split(order, np.cumsum(counts)[:-1])):
        pairs = np.concatenate([features[members], targets[members]], axis=1, dtype=float)
        mean = pairs.mean(axis=0)
        pairs -= mean
        scatter = pairs.T @ pairs
        means[c], scatters[c], spread[c] = mean, scatter[lower], np.trace(scatter[:size, :size]) / len(members)
    return MomentTable(size, counts.astype(float), means, scatters, spread)


def cells_for(examples: int) -> int:
    """Number of cells for so many examples."""
    return max(1, min(MAX_CELLS, math.ceil(examples / EXAMPLES_PER_CELL)))


@compiled
def local_gaussian(table: MomentTable, query: Floats, neighbours: int, width: float) -> LocalGaussian:
    """Moments of about the `neighbours` nearest examples of a query (F,), weighted by distance.

    Weights are exp(-d^2 / 2 v) for mean squared distances d^2 of the cells, where v is `width` times the squared
    distance within which half of the neighbours lie (as eq. 6 of Liu et al. 2011 with D_w = 1 / v).
    """
    cells, size = table.mean.shape
    squared = np.empty(cells)
    for c in range(cells):
        row, total = table.mean[c], table.spread[c]
        for i in range(table.features):
            offset = query[i] - row[i]
            total += offset * offset
        squared[c] = total
    chosen, distance, used = np.empty(cells, np.int64), np.empty(cells), 0
    held, half = 0.0, -1.0
    while held < neighbours and used < cells:
        best = np.argmin(squared)
        chosen[used], distance[used], squared[best] = best, squared[best], np.inf
        held += table.examples[best]
        if half < 0.0 and held >= 0.5 * neighbours:
            half = distance[used]
        used += 1
    variance = max(width * (half if half >= 0.0 else distance[used - 1]), _TINY)
    weight, total = np.empty(used), 0.0
    for k in range(used):
        weight[k] = np.exp((distance[0] - distance[k]) / (2.0 * variance))
        total += weight[k] * table.examples[chosen[k]]
    mean = np.zeros(size)
    for k in range(used):
        weight[k] /= total
        row, share = table.mean[chosen[k]], weight[k] * table.examples[chosen[k]]
        for i in range(size):
            mean[i] += share * row[i]
    packed = np.zeros(table.scatter.shape[1], np.float32)
    offset = np.empty(size, np.float32)
    for k in range(used):
        row, share = table.scatter[chosen[k]], np.float32(weight[k])
        for i in range(len(packed)):
            packed[i] += share * row[i]
        away, share = table.mean[chosen[k]], np.float32(weight[k] * table.examples[chosen[k]])
        for i in range(size):
            offset[i] = away[i] - mean[i]
        at = 0
        for i in range(size):
            scaled = share * offset[i]
            part = packed[at : at + i + 1]
            for j in range(i + 1):
                part[j] += scaled * offset[j]
            at += i + 1
    covariance = np.empty((size, size))
    at = 0
    for i in range(size):
        for j in range(i + 1):
            covariance[i, j] = packed[at + j]
        at += i + 1
    return LocalGaussian(mean, covariance)


@compiled
def condition(local: LocalGaussian, query: Floats, noise: Floats, ridge: float) -> tuple[Floats, Floats]:
    """Mean (Y,) and covariance (Y, Y) of the targets, given features (F,) with errors of covariance `noise` (F, F).

    `ridge` is a further variance of each feature's error, as a share of the trace of their covariance. With
    `np.linalg.solve` the same takes twice as long for 36 features.
    """
    features = len(query)
    targets = len(local.mean) - features
    factor, trace = np.empty((features, features)), 0.0
    for i in range(features):
        trace += local.covariance[i, i]
        for j in range(i + 1):
            factor[i, j] = local.covariance[i, j] + noise[i, j]
    for i in range(features):
        factor[i, i] += ridge * trace + _TINY
    # rows: L^-1 [S_fy | f - mean], by which everything below is a product of rows
    rows = np.empty((features, targets + 1))
    for i in range(features):
        for j in range(targets):
            rows[i, j] = local.covariance[features + j, i]
        rows[i, targets] = query[i] - local.mean[i]
    for i in range(features):
        for k in range(i):
            share = factor[i, k] * factor[k, k]  # the diagonal holds reciprocals
            factor[i, k] = share
            for j in range(k + 1, i + 1):
                factor[i, j] -= share * factor[j, k]
            row, other = rows[i], rows[k]
            for j in range(targets + 1):
                row[j] -= share * other[j]
        factor[i, i] = 1.0 / np.sqrt(factor[i, i])
        for j in range(targets + 1):
            rows[i, j] *= factor[i, i]
    mean, covariance = local.mean[features:].copy(), np.empty((targets, targets))
    for i in range(targets):
        for j in range(i + 1):
            covariance[i, j] = local.covariance[features + i, features + j]
    for k in range(features):
        row = rows[k]
        for i in range(targets):
            mean[i] += row[i] * row[targets]
            share, out = row[i], covariance[i]
            for j in range(i + 1):
                out[j] -= share * row[j]
    for i in range(targets):
        for j in range(i):
            covariance[j, i] = covariance[i, j]
    return mean, covariance
