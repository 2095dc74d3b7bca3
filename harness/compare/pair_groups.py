"""Pairs of cells that are pooled: those of one method, with the same inputs and split."""

from collections.abc import Iterable
from dataclasses import dataclass, replace

from harness.compare.matching import CellPair


@dataclass(frozen=True)
class PairGroup:
    """Pairs of cells that are pooled."""

    method: str
    text: str
    """Inputs and split, which all pairs share."""
    pairs: tuple[CellPair, ...]
    part: str = ""

    @property
    def title(self) -> str:
        return f"{self.method} ({self.text})"

    @property
    def parts(self) -> "list[PairGroup]":
        """The pairs of each behaviour and of known and new performers; of neither where all pairs have the same."""
        behaviours, performers = dict[str, list[CellPair]](), dict[str, list[CellPair]]()
        for a, b in self.pairs:
            behaviours.setdefault(a.behaviour, []).append((a, b))
            performers.setdefault(f"{a.performer or b.performer} performers", []).append((a, b))
        return [
            replace(self, pairs=tuple(pairs), part=name)
            for by_name in (behaviours, performers)
            for name, pairs in by_name.items()
            if len(by_name) > 1
        ]


def group_pairs(pairs: Iterable[CellPair]) -> list[PairGroup]:
    """Group pairs by method, inputs and split, in the order of the pairs."""
    groups: dict[tuple[str, str], list[CellPair]] = {}
    for a, b in pairs:
        method = a.method if a.method == b.method else f"{a.method} vs {b.method}"
        split = b.split if a.split == "none" else a.split
        text = ", ".join(filter(None, (a.inputs, split)))
        groups.setdefault((method, text), []).append((a, b))
    return [PairGroup(*name, tuple(members)) for name, members in groups.items()]
