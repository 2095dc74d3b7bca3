"""The files that a cell's key covers: code of a method's own package or folder, and declared data files."""

import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

from harness.errors import BadInput
from harness.reconstruct import registry
from harness.reconstruct.methods.ik import GAUSSIAN, Ik
from harness.reconstruct.source_files import find_source_files, source_hash

CLASS = "from harness.reconstruct.methods.ik import Ik\n\n\nclass Mine(Ik):\n    "


def write(folder: Path, files: Mapping[str, str]) -> None:
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A folder of a user's methods, which lies on `sys.path`; its modules are forgotten after the test."""
    monkeypatch.syspath_prepend(tmp_path)
    before = set(sys.modules)
    yield tmp_path
    for name in set(sys.modules) - before:
        del sys.modules[name]


HELPERS = {
    "a module": ("import gains", "gains.py"),
    "a module of a folder": ("from tools import gains", "tools/gains.py"),
    "a module deep in folders": ("import tools.inner.gains as g", "tools/inner/gains.py"),
    "the code of a folder": ("import tools", "tools/__init__.py"),
    "a name of a module of a folder": ("from tools.gains import SIGMA", "tools/gains.py"),
    "an import in a function": ("def later():\n    from tools import gains\n", "tools/gains.py"),
    "an import by name": ("import importlib\nimportlib.import_module('tools.gains')", "tools/gains.py"),
}


@pytest.mark.parametrize(("statement", "helper"), HELPERS.values(), ids=HELPERS)
def test_an_edited_helper_changes_the_hash_and_other_files_do_not(folder: Path, statement: str, helper: str) -> None:
    write(
        folder, {"mine.py": f"{statement}\n{CLASS}...\n", helper: "SIGMA = 1.0\n", "stranger.py": "", "notes.txt": ""}
    )
    mine = registry.make_method("mine:Mine")
    before = source_hash(mine)
    write(folder, {"stranger.py": "OTHER = 2.0\n", "notes.txt": "more"})
    assert source_hash(mine) == before
    write(folder, {helper: "SIGMA = 2.0\n"})
    assert source_hash(mine) != before


def test_helpers_of_helpers_and_relative_imports_count(folder: Path) -> None:
    write(
        folder,
        {
            "mine.py": f"from tools.first import *\n{CLASS}...\n",
            "tools/__init__.py": "",
            "tools/first.py": "from . import second\n",
            "tools/second.py": "from .inner.third import SIGMA\n",
            "tools/inner/third.py": "from ..fourth import SIGMA\n",
            "tools/fourth.py": "SIGMA = 1.0\n",
        },
    )
    found = {file.relative_to(folder).as_posix() for file in find_source_files(registry.make_method("mine:Mine")).files}
    assert found == {
        "mine.py",
        *(f"tools/{name}.py" for name in ("__init__", "first", "second", "inner/third", "fourth")),
    }


def test_every_module_of_the_own_package_counts_and_the_helpers_next_to_it(folder: Path) -> None:
    write(
        folder,
        {
            "lab/__init__.py": "",
            "lab/methods/mine.py": f"import shared\n{CLASS}...\n",
            "lab/plugins/found_by_name.py": "",
            "shared.py": "",
            "stranger.py": "",
        },
    )
    files = find_source_files(registry.make_method("lab.methods.mine:Mine"))
    assert files.folders == (folder,)
    assert {file.relative_to(folder).as_posix() for file in files.files} == {
        *("lab/__init__.py", "lab/methods/mine.py", "lab/plugins/found_by_name.py", "shared.py")
    }


def test_declared_data_files_change_the_hash(folder: Path) -> None:
    write(
        folder,
        {
            "mine.py": f"{CLASS}files = ['weights.json', 'tables']\n",
            "weights.json": "[1.0]",
            "tables/a.txt": "1",
            "other.json": "",
        },
    )
    mine = registry.make_method("mine:Mine")
    hashes = [source_hash(mine)]
    for file in ("weights.json", "tables/a.txt", "tables/new.txt"):
        write(folder, {file: "2.0"})
        hashes.append(source_hash(mine))
    assert len(set(hashes)) == 4
    write(folder, {"other.json": "2.0"})
    assert source_hash(mine) == hashes[-1]


@pytest.mark.parametrize(
    ("files", "message"), [("['none.json']", "does not exist"), ("'weights.json'", "list of paths"), ("[3]", "list of")]
)
def test_declarations_that_cannot_be_used_are_refused(folder: Path, files: str, message: str) -> None:
    write(folder, {"mine.py": f"{CLASS}files = {files}\n", "weights.json": ""})
    with pytest.raises(BadInput, match=message):
        source_hash(registry.make_method("mine:Mine"))


def test_the_hash_does_not_depend_on_where_the_folder_lies(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    hashes = []
    for place in ("one", "two"):
        write(folder / place, {"mine.py": f"import gains\n{CLASS}...\n", "gains.py": "SIGMA = 1.0\n"})
        monkeypatch.setattr(sys, "path", [str(folder / place), *sys.path])
        for module in ("mine", "gains"):
            sys.modules.pop(module, None)
        hashes.append(source_hash(registry.make_method("mine:Mine")))
    assert hashes[0] == hashes[1]


def test_two_files_that_swap_their_contents_change_the_hash(folder: Path) -> None:
    write(folder, {"mine.py": f"import a, b\n{CLASS}...\n", "a.py": "X = 1\n", "b.py": "X = 2\n"})
    mine = registry.make_method("mine:Mine")
    before = source_hash(mine)
    write(folder, {"a.py": "X = 2\n", "b.py": "X = 1\n"})
    assert source_hash(mine) != before


def test_methods_and_what_they_wrap_have_other_hashes() -> None:
    hashes = {source_hash(registry.make_method(n)) for n in ("ik", "mean_pose", "best_match", "mean_pose+ik", "ik+ik")}
    assert len(hashes) == 5
    assert source_hash(Ik()) == source_hash(GAUSSIAN)


def test_a_wrapped_method_from_outside_counts(folder: Path) -> None:
    write(folder, {"mine.py": f"import gains\n{CLASS}...\n", "gains.py": "SIGMA = 1.0\n"})
    mine = registry.make_method("mine:Mine+ik")
    before = source_hash(mine)
    write(folder, {"gains.py": "SIGMA = 2.0\n"})
    assert source_hash(mine) != before
