"""Which cells of two sides belong together, and in which inputs those that do are different."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from harness.core.files import content_key, to_json_types
from harness.errors import BadInput, UnknownName
from harness.results.cell import varied_text
from harness.results.manifest import flatten
from harness.results.reader import CellResult, ResultSet

PAIRING_KEYS = ("scenario", "clip", "seed", "method", "inputs", "split", "noise", "varied")
RELAXABLE_KEYS = ("scenario", "seed", "inputs", "split", "noise", "varied")
"""Those that cells may be allowed to differ in and still pair."""
_LEARNING_INPUTS = ("examples", "withheld")
"""Inputs of a method that learns; one that does not has none."""
_MAX_CHARACTERS = 24

CellPair = tuple[CellResult, CellResult]


@dataclass(frozen=True)
class CellPairing:
    """Pairs in A's order, and the cells that found no partner."""

    pairs: tuple[CellPair, ...]
    only_a: tuple[CellResult, ...]
    only_b: tuple[CellResult, ...]
    why_none: str = ""
    """What keeps all of them apart when there is no pair, such as "seed: 1 against 2"."""


def pair_cells(a: ResultSet, b: ResultSet, methods: tuple[str, str] | None, but_for: Collection[str]) -> CellPairing:
    """Cells that agree in all of `PAIRING_KEYS` but for the names in `but_for`.

    With two `methods`, cells of the one in A and of the other in B, whatever their names; a method that learns nothing
    (split "none") then pairs with any. UnknownName for a method that a side has no cell of, BadInput when two
    cells of a side cannot be told apart.
    """
    cells_a, cells_b = (list(_cells_of_method(side, at, methods)) for at, side in enumerate((a, b)))
    names = [name for name in PAIRING_KEYS if name not in but_for]
    if methods:
        names.remove("method")
        if "none" in {c.split for c in cells_a} | {c.split for c in cells_b} and "split" in names:
            names.remove("split")
    keyed_a, keyed_b = _cells_by_key(cells_a, names, a.title), _cells_by_key(cells_b, names, b.title)
    pairs = tuple((cell, keyed_b[key]) for key, cell in keyed_a.items() if key in keyed_b)
    return CellPairing(
        pairs,
        tuple(cell for key, cell in keyed_a.items() if key not in keyed_b),
        tuple(cell for key, cell in keyed_b.items() if key not in keyed_a),
        "" if pairs else _explain_no_pairs(cells_a, cells_b, names),
    )


def _cells_of_method(side: ResultSet, at: int, methods: tuple[str, str] | None) -> Iterable[CellResult]:
    if methods is None:
        return side.cells
    known = dict.fromkeys(cell.method for cell in side.cells)
    if methods[at] not in known:
        raise UnknownName(f"method in {side.title}", methods[at], known)
    return (cell for cell in side.cells if cell.method == methods[at])


def _cells_by_key(cells: Iterable[CellResult], names: Sequence[str], title: str) -> dict[str, CellResult]:
    found: dict[str, CellResult] = {}
    for cell in cells:
        key = content_key({name: getattr(cell, name) for name in names})
        if key in found:
            raise BadInput(
                f"{title} has {format_cell_name(cell)} twice.",
                f"Cells of a side must differ in one of {', '.join(names)}.",
            )
        found[key] = cell
    return found


def _explain_no_pairs(a: Sequence[CellResult], b: Sequence[CellResult], names: Sequence[str]) -> str:
    """The names in which no cell of A agrees with any of B; all that differ if each agrees somewhere."""
    values = {name: (_values(a, name), _values(b, name)) for name in names}
    never = {name: both for name, both in values.items() if not set(both[0]) & set(both[1])}
    differing = never or {name: both for name, both in values.items() if both[0] != both[1]}
    texts = (
        f"{name}: {_format_values(mine)} against {_format_values(theirs)}" for name, (mine, theirs) in differing.items()
    )
    return "; ".join(texts) if a and b else "a side has no cells"


def _values(cells: Sequence[CellResult], name: str) -> list[str]:
    values = (getattr(cell, name) for cell in cells)
    return list(dict.fromkeys(varied_text(v) if isinstance(v, Mapping) else str(v) for v in values))


def _format_values(values: Sequence[str]) -> str:
    shown = ", ".join(value or "nothing" for value in values[:3])
    return shown + (f" and {len(values) - 3} more" if len(values) > 3 else "")


def format_cell_name(cell: CellResult) -> str:
    """What the cell is called, such as "ik on walking_p1_01 (pos, noise=clean, demo, seed 1)"."""
    texts = ("" if cell.inputs == "pos+ori" else cell.inputs, varied_text(cell.varied), cell.scenario)
    besides = [text for text in texts if text]
    return f"{cell.method} on {cell.clip} ({', '.join([*besides, f'seed {cell.seed}'])})"


def inputs_that_differ(
    pairs: Sequence[CellPair], metrics: Collection[str], but_for: Collection[str] = ()
) -> dict[str, str]:
    """Dotted name of each input in which the cells of a pair differ -> "tracker.rate_hz: 40 against 60".

    Versions count of the `metrics` that are compared. Where one of the two learns nothing, what the other learnt from
    is no difference of inputs. `but_for` are names of `PAIRING_KEYS` in which cells were allowed to differ.
    """
    found: dict[str, list[tuple[Any, Any, str]]] = {}
    for a, b in pairs:
        mine, theirs = (flatten(to_json_types(cell.defined_by)) for cell in (a, b))
        ignored = _LEARNING_INPUTS if "none" in (a.split, b.split) and a.split != b.split else ()
        for name in {**mine, **theirs}:
            first, _, rest = name.partition(".")
            if first in ignored or (first == "metric_versions" and rest not in metrics):
                continue
            one, other = (None if side.get(name) == {} else side.get(name) for side in (mine, theirs))
            if one != other:
                found.setdefault(name, []).append((one, other, a.clip))
    return {name: _text(name, differing, len(pairs)) for name, differing in found.items()}


def _text(name: str, differing: Sequence[tuple[Any, Any, str]], pairs: int) -> str:
    mine, theirs, clip = differing[0]
    texts = shorten_value(mine), shorten_value(theirs)
    text = f"{name}: {' against '.join(texts if texts[0] != texts[1] else map(format_value, (mine, theirs)))}"
    if any(other[:2] != (mine, theirs) for other in differing):
        text += f" on {clip}"
    return text if len(differing) == pairs else f"{text} ({len(differing)} of {pairs} pairs)"


def shorten_value(value: Any) -> str:
    """In a few signs."""
    text = f"{value:g}" if isinstance(value, float) else format_value(value)
    return text if len(text) <= _MAX_CHARACTERS else text[: _MAX_CHARACTERS - 1] + "…"


def format_value(value: Any) -> str:
    """Whole."""
    if isinstance(value, list):
        value = ", ".join(map(str, value)) or None
    return "none" if value is None else str(value)
