"""Folders of the package use each other through doors: the names in the `__init__.py` of a folder."""

import ast
import inspect
import re
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest

from harness.core.door import door_names
from tests.test_layers import PACKAGE, modules, tree_of

FOLDERS_WITH_A_DOOR = {
    *("stream", "reconstruct", "simulate", "mocap", "calibrate", "measure", "results", "compare", "score", "body"),
    *("view", "live", "experiment"),
}
MOST_NAMES = 40
DOORS = sorted(
    name
    for name, file in modules().items()
    if file.name == "__init__.py" and name != "harness" and "lazy_names(" in file.read_text(encoding="utf-8")
)
TESTS = Path(__file__).parent
LOOKS_INSIDE = {
    "planted.py": "plants errors where the engine computes them",
    "scored_run.py": "makes the identity of a cell as the results do",
    "compare/sides.py": "makes the columns of a table as the results do",
    "fuzz/mending.py": "mends digests, so that a damaged file is read further",
    "experiment/evil_methods.py": "methods that try to replace functions of the score",
    "core/test_cache_folder.py": "the cache of a method's files is one of the folders that are found",
}
"""Tests that look inside other folders, and why."""


def door_of(module: str) -> str:
    """The door through which others use a module; "" for a module of a folder without one."""
    return max((door for door in DOORS if f"{module}.".startswith(f"{door}.")), key=len, default="")


@cache
def imports(file: Path) -> frozenset[tuple[str, str]]:
    """Module and name of each import from the package in a file; the name of an imported module is ""."""
    found = set[tuple[str, str]]()
    for node in ast.walk(tree_of(file)):
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith("harness."):
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                found.add((whole, "") if whole in modules() else (str(node.module), alias.name))
        elif isinstance(node, ast.Import):
            found |= {(alias.name, "") for alias in node.names if alias.name.startswith("harness.")}
    return frozenset(found)


def reaches_inside(file: Path, own: str) -> list[str]:
    """What a file imports from inside other folders than its own."""
    return [
        f"{module}.{name}"
        for module, name in sorted(imports(file))
        if (door := door_of(module)) and door.split(".")[1] != own and module != door
    ]


def test_every_folder_of_the_design_has_a_door() -> None:
    assert {door.split(".")[1] for door in DOORS if door.count(".") == 1} == FOLDERS_WITH_A_DOOR


@pytest.mark.parametrize("folder", sorted(path.name for path in PACKAGE.iterdir() if path.is_dir()))
def test_a_folder_uses_others_through_their_doors(folder: str) -> None:
    for file in (PACKAGE / folder).rglob("*.py"):
        assert not reaches_inside(file, folder), file.relative_to(PACKAGE)


def test_tests_look_inside_their_own_folder_only() -> None:
    inside = {
        place: found
        for file in TESTS.rglob("*.py")
        if (place := file.relative_to(TESTS).as_posix()) and (found := reaches_inside(file, place.split("/")[0]))
    }
    assert inside.keys() == LOOKS_INSIDE.keys(), {place: inside[place] for place in inside.keys() - LOOKS_INSIDE.keys()}


@pytest.mark.parametrize("door", DOORS)
def test_a_door_is_narrow_and_its_names_can_be_used(door: str) -> None:
    package = import_module(door)
    names = list(door_names(door))
    assert 0 < len(names) <= MOST_NAMES
    assert package.__all__ == sorted(names), "for `import *`"
    inside = {module.removeprefix(f"{door}.").split(".")[0] for module in modules() if module.startswith(f"{door}.")}
    assert not inside & set(names), "the import of a module of that name would hide the name"
    for name in names:
        value = getattr(package, name)
        if inspect.isclass(value) or inspect.isfunction(value):
            assert inspect.getdoc(value), f"{door}.{name}"
        module, _ = door_names(door)[name]
        assert door_of(module) == door, f"{door}.{name} lies behind another door"


@pytest.mark.parametrize("door", DOORS)
def test_every_name_of_a_door_is_used_by_others(door: str) -> None:
    own = door.split(".")[1]
    root = TESTS.parent
    sources = {*PACKAGE.rglob("*.py"), *TESTS.rglob("*.py"), *(root / "examples").rglob("*.py")}
    pages = "".join(page.read_text(encoding="utf-8") for page in (root / "docs").glob("*.md"))
    used = set(re.findall(rf"from {re.escape(door)} import (\w+)$", pages, re.MULTILINE))
    for file in sources:
        folder = file.relative_to(root).parts[1]
        if folder == own:
            continue
        used |= {name for module, name in imports(file) if module == door and name}
        if (door, "") in imports(file):
            used |= {node.attr for node in ast.walk(tree_of(file)) if isinstance(node, ast.Attribute)}
    import_module(door)
    assert set(door_names(door)) <= used


@pytest.mark.long
def test_the_reference_lists_the_names_of_a_door() -> None:
    griffe = pytest.importorskip("griffe")
    extensions = griffe.load_extensions(str(TESTS.parent / "docs" / "site" / "docstrings.py"))
    package = griffe.load("harness", search_paths=[str(TESTS.parent)], extensions=extensions)
    import_module("harness.view")
    assert set(package["view"].exports) == set(door_names("harness.view"))
    assert package["core.door"].exports is None
