"""Declared packages: what the package imports is declared, each has a row in docs, and errors name real extras."""

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
PAGE = (ROOT / "docs" / "installation.md").read_text(encoding="utf-8")
PACKAGE_OF = {
    "cv2": "opencv-python-headless",
    "dask": "distributed",  # which is installed with it
    "faiss": "faiss-cpu",
    "imageio_ffmpeg": "imageio-ffmpeg",
    "PIL": "pillow",
    "pymotion": "upc-pymotion",
    "pythonosc": "python-osc",
    "serial": "pyserial",
    "tomli_w": "tomli-w",
}
"""Packages of the modules whose names differ."""
DEVELOPMENT = {"test", "dev", "docs"}
"""Extras of those who change the harness."""
OTHERS = {"_typeshed", "pytest"}
"""Types alone, and packages that `harness.testing` uses where they are installed."""
OPENS_WITH_AN_EXTRA = {
    "bench/ik.py",
    "body/rendering.py",
    "live/pose_sheet.py",
    "live/viewer_process.py",
    "view/movie_worker.py",
}
"""Files that import a package of an extra when they are loaded; others load them where the extra is installed."""


def names(requirements: list[str]) -> set[str]:
    return {re.match(r"[\w.-]+", text).group() for text in requirements}  # type: ignore[union-attr]


CORE = names(PROJECT["dependencies"])
EXTRAS = {extra: names(texts) - {PROJECT["name"]} for extra, texts in PROJECT["optional-dependencies"].items()}
OPTIONAL = set[str]().union(*(packages for extra, packages in EXTRAS.items() if extra not in DEVELOPMENT))
FILES = {file.relative_to(ROOT / "harness").as_posix(): file for file in (ROOT / "harness").rglob("*.py")}
TREES = {name: ast.parse(file.read_text(encoding="utf-8")) for name, file in FILES.items()}


def imported_packages(nodes: Iterator[ast.AST] | list[ast.stmt]) -> set[str]:
    found: set[str] = set()
    for node in nodes:
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(str(node.module).split(".")[0])
    return {PACKAGE_OF.get(name, name) for name in found - set(sys.stdlib_module_names) - {"harness"}}


def test_every_import_is_declared_and_every_declared_package_is_imported() -> None:
    imported = set[str]().union(*(imported_packages(ast.walk(tree)) for tree in TREES.values()))
    assert imported - OTHERS <= CORE | OPTIONAL
    assert imported >= CORE


def loaded_statements(tree: ast.Module) -> list[ast.stmt]:
    """The statements that are executed when a module is loaded, also those of a block such as `plain_import`."""
    return [*tree.body, *(part for node in tree.body if isinstance(node, ast.With) for part in node.body)]


def test_only_files_that_need_an_extra_import_it_when_they_are_loaded() -> None:
    opened = {name for name, tree in TREES.items() if imported_packages(loaded_statements(tree)) & OPTIONAL}
    assert opened == OPENS_WITH_AN_EXTRA


def missing_extras() -> list[tuple[str, ast.Call]]:
    return [
        (name, node)
        for name, tree in TREES.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "MissingExtra"
    ]


def test_errors_name_extras_that_exist() -> None:
    calls = missing_extras()
    assert len(calls) >= 8
    for name, call in calls:
        extra = call.args[2]
        assert isinstance(extra, ast.Constant), name
        assert extra.value in EXTRAS, name
        if isinstance(package := call.args[1], ast.Constant):
            assert names([str(package.value)]) <= EXTRAS[str(extra.value)], name


def rows(heading: str) -> dict[str, str]:
    """Rows of the table below a heading by the code words of their first cell."""
    section = PAGE.split(f"\n## {heading}\n")[1].split("\n## ")[0]
    cells = [line.strip("|").split("|") for line in section.splitlines() if line.startswith("|")][2:]
    return {word: "|".join(row) for row in cells for word in re.findall(r"`([^`]+)`", row[0])}


def test_the_page_has_a_row_for_each_package_of_a_plain_installation() -> None:
    assert set(rows("A plain installation")) == CORE


@pytest.mark.parametrize("extra", sorted(EXTRAS))
def test_the_page_has_a_row_for_each_extra_with_its_packages(extra: str) -> None:
    table = rows("Extras")
    assert set(table) == set(EXTRAS)
    if extra not in DEVELOPMENT:
        assert set(re.findall(r"`([^`]+)`", table[extra].split("|")[1])) == EXTRAS[extra]
