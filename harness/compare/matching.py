"""Pairing of the cells of two results, and the inputs in which paired cells differ."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from harness.core.files import content_key, to_json_types
from harness.errors import BadInput, UnknownName
from harness.results import CellResult, ResultSet, flatten, varied_text

PAIRING_KEYS = ("scenario", "clip", "seed", "method", "inputs", "split", "noise", "varied")
RELAXABLE_KEYS = ("scenario", "seed", "inputs", "split", "noise", "varied")
"""Keys in which paired cells may be allowed to differ."""
_LEARNING_INPUTS = ("examples", "withheld")
"""Inputs that only methods which learn have."""
_MAX_CHARACTERS = 24

CellPair = tuple[CellResult, CellResult]


@dataclass(frozen=True)
class CellPairing:
    """Pairs in the order of A, and cells without a partner."""

    pairs: tuple[CellPair, ...]
    only_a: tuple[CellResult, ...]
    only_b: tuple[CellResult, ...]
    why_none: str = ""
    """Why no cells pair, such as "seed: 1 against 2"; "" where some do."""


def pair_cells(
    a: ResultSet, b: ResultSet, methods: tuple[str, str] | None, except_keys: Collection[str]
) -> CellPairing:
    """Pair cells that agree in all of `PAIRING_KEYS` except the names in `except_keys`.

    With two `methods`, cells of the first in A pair with cells of the second in B; a method that does not learn (split
    "none") then pairs with any split. UnknownName for a method that a side lacks, BadInput for duplicate cells.
    """
    cells_a, cells_b = (list(_cells_of_method(side, at, methods)) for at, side in enumerate((a, b)))
    names = [name for name in PAIRING_KEYS if name not in except_keys]
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
    names = dict.fromkeys(cell.method for cell in side.cells)
    if methods[at] not in names:
        raise UnknownName(f"method in {side.title}", methods[at], names)
    return (cell for cell in side.cells if cell.method == methods[at])


def _cells_by_key(cells: Iterable[CellResult], names: Sequence[str], title: str) -> dict[str, CellResult]:
    keyed: dict[str, CellResult] = {}
    for cell in cells:
        key = content_key({name: getattr(cell, name) for name in names})
        if key in keyed:
            raise BadInput(
                f"{title} has {format_cell_name(cell)} twice.",
                f"The cells of one side must differ in at least one of {', '.join(names)}.",
            )
        keyed[key] = cell
    return keyed


def _explain_no_pairs(a: Sequence[CellResult], b: Sequence[CellResult], names: Sequence[str]) -> str:
    """Name the keys in which no cell of A agrees with any of B; if there is none, all keys that differ somewhere."""
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
    """The displayed name of a cell, such as "ik on walking_p1_01 (pos, noise=clean, demo, seed 1)"."""
    texts = ("" if cell.inputs == "pos+ori" else cell.inputs, varied_text(cell.varied), cell.scenario)
    details = [text for text in texts if text]
    return f"{cell.method} on {cell.clip} ({', '.join([*details, f'seed {cell.seed}'])})"


def inputs_that_differ(
    pairs: Sequence[CellPair], metrics: Collection[str], except_keys: Collection[str] = ()
) -> dict[str, str]:
    """Dotted name of each input in which the cells of a pair differ -> "tracker.rate_hz: 40 against 60".

    Of metric versions, only those of the compared `metrics` count. Where only one of two methods learns, its examples
    are not a difference of inputs.
    """
    differing: dict[str, list[tuple[Any, Any, str]]] = {}
    for a, b in pairs:
        mine, theirs = (flatten(to_json_types(cell.defined_by)) for cell in (a, b))
        ignored = _LEARNING_INPUTS if "none" in (a.split, b.split) and a.split != b.split else ()
        for name in {**mine, **theirs}:
            first, _, rest = name.partition(".")
            if first in ignored or (first == "metric_versions" and rest not in metrics):
                continue
            value_a, value_b = (None if side.get(name) == {} else side.get(name) for side in (mine, theirs))
            if value_a != value_b:
                differing.setdefault(name, []).append((value_a, value_b, a.clip))
    return {name: _text(name, values, len(pairs)) for name, values in differing.items()}


def _text(name: str, differing: Sequence[tuple[Any, Any, str]], pairs: int) -> str:
    mine, theirs, clip = differing[0]
    texts = shorten_value(mine), shorten_value(theirs)
    text = f"{name}: {' against '.join(texts if texts[0] != texts[1] else map(format_value, (mine, theirs)))}"
    if any(other[:2] != (mine, theirs) for other in differing):
        text += f" on {clip}"
    return text if len(differing) == pairs else f"{text} ({len(differing)} of {pairs} pairs)"


def shorten_value(value: Any) -> str:
    """A value as text, cut to a few characters."""
    text = f"{value:g}" if isinstance(value, float) else format_value(value)
    return text if len(text) <= _MAX_CHARACTERS else text[: _MAX_CHARACTERS - 1] + "…"


def format_value(value: Any) -> str:
    """A value as text."""
    if isinstance(value, list):
        value = ", ".join(map(str, value)) or None
    return "none" if value is None else str(value)
