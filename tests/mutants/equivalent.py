"""Mutations that no test can notice, with the reason of each: `equivalent.toml`."""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.mutants.operators import Mutation

FILE = Path(__file__).with_name("equivalent.toml")


@dataclass(frozen=True)
class Equivalent:
    """An entry. Line numbers are left out, for they change with every edit."""

    file: str
    operator: str
    line: str
    """The source line, stripped."""
    mutant: str
    """The line after the change, stripped."""
    reason: str

    def matches(self, mutation: Mutation) -> bool:
        wanted = self.file, self.operator, self.line, self.mutant
        return wanted == (mutation.file, mutation.operator, mutation.line, mutation.mutant)


def read_equivalents(path: Path = FILE) -> list[Equivalent]:
    """The entries of a file; TypeError where one lacks a key or has another."""
    return [Equivalent(**entry) for entry in tomllib.loads(path.read_text(encoding="utf-8")).get("equivalent", [])]


def unmatched(entries: Sequence[Equivalent], mutations: Sequence[Mutation]) -> list[Equivalent]:
    """Entries that no possible mutation matches: the code has changed, or the entry is misspelt."""
    return [entry for entry in entries if not any(entry.matches(mutation) for mutation in mutations)]


def reason_of(mutation: Mutation, entries: Sequence[Equivalent]) -> str:
    """The reason why a mutation is equivalent; "" where it is not listed."""
    return next((entry.reason for entry in entries if entry.matches(mutation)), "")
