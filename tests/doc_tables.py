"""Tables of the documents that are made from the code: `python -m tests.doc_tables` writes them anew.

A table stands between `<!-- table NAME -->` and `<!-- end of table NAME -->`. Its texts are docstrings and definitions,
so that a change of the code is made in one place. tests/test_doc_tables.py holds the pages to the code.
"""

import ast
import dataclasses
import inspect
import json
import re
import textwrap
from collections.abc import Iterator
from typing import Any, get_args, get_origin, get_type_hints

from harness.experiment.scenarios import CalibrationSettings, Scenario, ScenarioMotion, Station
from harness.score import DEFINITIONS, SIGMA_DEFINITIONS
from harness.simulate import Disturbance, TrackerConfig
from tests.test_prose import ROOT

_SCENARIO = {
    "": Scenario,
    "motion.": ScenarioMotion,
    "stations.NAME.": Station,
    "tracker.": TrackerConfig,
    "calibrating.": CalibrationSettings,
    "disturbance.": Disturbance,
}
"""Beginning of a key -> the record whose fields it has."""
_LEFT_OUT = {"schema", "name", *(prefix.removesuffix(".") for prefix in _SCENARIO)}
"""Fields of a scenario without a row of their own."""


def docstrings(kind: type) -> dict[str, str]:
    """Field -> its docstring, in one line."""
    (node,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
    assert isinstance(node, ast.ClassDef)
    found = {}
    for field, text in zip(node.body, node.body[1:], strict=False):
        match field, text:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str() as said)):
                found[name] = " ".join(said.split())
    return found


def _default(field: "dataclasses.Field[Any]") -> str:
    """The default as TOML; nothing where it is empty, and `needed` where there is none."""
    if field.default is dataclasses.MISSING:
        return "" if field.default_factory is not dataclasses.MISSING else "needed"
    value = list(field.default) if isinstance(field.default, tuple) else field.default
    if value in ("", [], None):
        return ""
    return f"`{json.dumps(value)}`"


def _choices(hint: Any) -> str:
    values = get_args(hint) if get_origin(hint) is not None else ()
    return "" if not values or not all(isinstance(v, str) for v in values) else ", ".join(f"`{v}`" for v in values)


def scenario_rows() -> Iterator[tuple[str, str, str]]:
    """Key, default and meaning of every key of a scenario but those of [physics], [components] and [[fault]]."""
    for prefix, kind in _SCENARIO.items():
        texts, hints = docstrings(kind), get_type_hints(kind)
        for field in dataclasses.fields(kind):
            if not prefix and field.name in _LEFT_OUT:
                continue
            choices = _choices(hints[field.name])
            text = f"{choices}. {texts[field.name]}" if choices else texts[field.name]
            yield f"`{prefix}{field.name}`", _default(field), re.sub(r" ?\(see `[^`]*`\)", "", text)


def metric_rows() -> Iterator[tuple[str, str, str]]:
    """Name, unit and definition of every metric."""
    for name, definition in {**DEFINITIONS, **SIGMA_DEFINITIONS}.items():
        yield f"`{name}`", definition.unit, definition.text


TABLES = {
    "scenario keys": ("docs/studies.md", ("key", "default", "meaning"), scenario_rows),
    "metrics": ("docs/metrics.md", ("name", "unit", "definition"), metric_rows),
}
"""Name -> page, head and rows."""


def make_table(name: str) -> str:
    """The table in Markdown."""
    _, head, rows = TABLES[name]
    lines = [head, ("---",) * len(head), *rows()]
    return "\n".join("| " + " | ".join(cell.replace("|", r"\|") for cell in line) + " |" for line in lines)


def replace_table(page: str, name: str) -> str:
    """A page with the present table in place of what stands between the marks of that name."""
    begin, end = f"<!-- table {name} -->", f"<!-- end of table {name} -->"
    before, _, rest = page.partition(begin)
    assert end in rest, f"no marks of the table {name}"
    return f"{before}{begin}\n{make_table(name)}\n{end}{rest.partition(end)[2]}"


def main() -> None:
    for name, (page, *_) in TABLES.items():
        path = ROOT / page
        path.write_text(replace_table(path.read_text(encoding="utf-8"), name), encoding="utf-8")
        print(f"{page}: {name}")


if __name__ == "__main__":
    main()
