"""The door of a folder: its public names, each imported when it is first used (PEP 562)."""

import sys
from collections.abc import Callable
from functools import cache
from typing import Any


def lazy_names(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` of a package, for the names that its `if TYPE_CHECKING` block imports.

    Type checkers read the block as it stands, where `A as A` marks a public name, and the program reads its source. A
    name is looked up at each use, so that it is always what its module has.

    The import of `harness` itself comes before the working folder is off the import path. Hence this module imports
    nothing else before a name is used.
    """

    def load_name(name: str) -> Any:
        from importlib import import_module

        if name == "__all__":
            return sorted(door_names(package))
        place = None if name.startswith("__") and name != "__version__" else door_names(package).get(name)
        if place is None:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module, attribute = place
        return getattr(import_module(module), attribute)

    return load_name, lambda: sorted({*vars(sys.modules[package]), *door_names(package)})


@cache
def door_names(package: str) -> dict[str, tuple[str, str]]:
    """Each name of a door -> the module that defines it, and its name there."""
    import ast

    with open(str(sys.modules[package].__file__), encoding="utf-8") as file:
        source = file.read()
    blocks = [node for node in ast.parse(source).body if isinstance(node, ast.If)]
    return {
        alias.asname or alias.name: (str(node.module), alias.name)
        for block in blocks
        for node in block.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
