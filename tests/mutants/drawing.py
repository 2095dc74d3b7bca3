"""The random draw of mutations: every line that can be mutated is equally likely."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tests.mutants.operators import Mutation, mutations

PACKAGES = ("simulate", "stream", "reconstruct", "score", "calibrate", "compare", "measure", "study")
"""Folders of `harness` whose lines are mutated."""


def all_mutations(root: Path, packages: Sequence[str] = PACKAGES) -> list[Mutation]:
    """All possible mutations of a checkout, in the order of files and lines."""
    files = [file for package in packages for file in sorted((root / "harness" / package).rglob("*.py"))]
    return [
        mutation
        for file in files
        for mutation in mutations(file.relative_to(root).as_posix(), file.read_text(encoding="utf-8"))
    ]


def draw(possible: Sequence[Mutation], count: int, rng: np.random.Generator) -> list[Mutation]:
    """`count` mutations, at most one a line: lines without replacement, and one mutation of each."""
    by_line: dict[tuple[str, int], list[Mutation]] = {}
    for mutation in possible:
        by_line.setdefault((mutation.file, mutation.number), []).append(mutation)
    lines = list(by_line.values())
    chosen = rng.permutation(len(lines))[:count]
    return [lines[k][int(rng.integers(len(lines[k])))] for k in chosen]
