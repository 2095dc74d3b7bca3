"""Docstrings as Markdown: "[s] [choice]" is a unit and a tag, and no link. Names of doors are public."""

import ast
import re
from typing import Any

from griffe import Extension, Module, Object


class TagsAreNoLinks(Extension):
    """Escapes the second of two brackets."""

    def on_object(self, *, obj: Object, **_: Any) -> None:
        if obj.docstring:
            obj.docstring.value = re.sub(r"\] \[(?=\w+\])", r"] \\[", obj.docstring.value)


class Doors(Extension):
    """Makes the names public that a door imports as `A as A`."""

    def on_module_members(self, *, node: Any, mod: Module, **_: Any) -> None:
        imports = (each for each in ast.walk(node) if isinstance(each, ast.ImportFrom))
        names = [alias.name for each in imports for alias in each.names if alias.name == alias.asname]
        if names:
            mod.exports = [*names]
