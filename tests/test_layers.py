"""Structure of the package, read off its source: which folder imports which, no circle, no name twice."""

import ast
import os
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import harness

PACKAGE = Path(harness.__file__).parent
FOLDERS = {p.name for p in PACKAGE.iterdir() if p.is_dir() and (p / "__init__.py").exists()}
LOOSE_FILES = {"__init__.py", "__main__.py", "cli.py", "errors.py", "py.typed"}

# The import table of docs/architecture.md. `core` and `errors` are open to all and not listed; a folder may import
# itself.
# The truth wall: `calibrate` and `reconstruct` see no simulation, motion file or score.
EXPERIMENT_SEES = {
    *("mocap", "body", "stream", "simulate", "calibrate", "reconstruct", "score", "results", "compare", "measure"),
}
MAY_IMPORT: dict[str, set[str]] = {
    "core": set(),
    "mocap": set(),
    "body": set(),
    "stream": set(),
    "simulate": {"body", "stream"},
    "calibrate": {"body", "stream"},
    "reconstruct": {"body", "stream"},
    "score": set(),
    "results": {"score"},
    "compare": {"results", "score"},
    "measure": {"stream"},
    "report": {"score", "results", "compare", "body", "measure"},
    "view": {"body", "stream", "report.kit"},
    "live": {"stream", "calibrate", "reconstruct", "body", "view", "mocap.write"},
    "experiment": EXPERIMENT_SEES,
    "study": EXPERIMENT_SEES | {"experiment"},
    "bench": FOLDERS - {"testing", "commands"},
    "testing": FOLDERS - {"study", "bench", "commands"},
    "commands": FOLDERS,
}
USES_MUJOCO = {"body", "simulate", "bench"}
RENAMES_FILES = {
    "core/files.py": "the atomic writers",
    "compare/baseline.py": "puts an old baseline aside before a new one takes its place",
    "live/file_outputs.py": "appends to a file, which takes its place with the first frame",
    "stream/recording/recording_writer.py": "appends to a recording",
}
"""Files that may call os.replace, os.rename or os.fsync, and why."""

NAMES_BONES = {"calibrate": 1, "core": 1, "experiment": 3, "reconstruct": 6, "study": 2, "testing": 1}
"""Most files of a folder that name `BONES` or `HINGES`. New code asks `Body` or its skeleton."""


def module_name(file: Path) -> str:
    parts = file.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def modules() -> dict[str, Path]:
    return {module_name(file): file for file in PACKAGE.rglob("*.py")}


@cache
def tree_of(file: Path) -> ast.Module:
    return ast.parse(file.read_text(encoding="utf-8"))


@cache
def imports_of(file: Path) -> frozenset[str]:
    """Every module that a file imports, wherever in the file: deferred and TYPE_CHECKING imports too."""
    found: set[str] = set()
    for node in ast.walk(tree_of(file)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import"
            whole = [f"{node.module}.{alias.name}" for alias in node.names]
            found |= {name if name in modules() else str(node.module) for name in whole}
    return frozenset(found)


def is_below(module: str, packages: set[str]) -> bool:
    """Whether a module is one of these, named below `harness`, or lies inside one."""
    return any(f"{module}.".startswith(f"harness.{package}.") for package in packages)


def test_no_file_lies_beside_the_folders() -> None:
    assert {p.name for p in PACKAGE.iterdir() if p.is_file()} == LOOSE_FILES


def test_the_table_names_every_folder() -> None:
    assert set(MAY_IMPORT) >= FOLDERS


@pytest.mark.parametrize("folder", sorted(FOLDERS))
def test_a_folder_imports_only_what_it_may(folder: str) -> None:
    allowed = MAY_IMPORT[folder] | {folder, "core", "errors"}
    files = list((PACKAGE / folder).rglob("*.py"))
    assert files
    for file in files:
        strange = [m for m in imports_of(file) if m.split(".")[0] == "harness" and not is_below(m, allowed)]
        assert not strange, f"{file.relative_to(PACKAGE)} imports {sorted(strange)}"


SHARED_BY_FAMILIES = {"polhemus"}
"""What device families may import: the Fastrak class of an IS-900 is the protocol of a FASTRAK."""


def test_a_device_family_sees_no_other() -> None:
    """Nor `recording`, which lies above the families. What families share sees none of them."""
    folders = {p.name for p in (PACKAGE / "stream").iterdir() if (p / "__init__.py").exists()}
    for family in folders - {"recording"}:
        others = {f"stream.{other}" for other in folders - {family} - SHARED_BY_FAMILIES}
        for file in (PACKAGE / "stream" / family).rglob("*.py"):
            assert not any(is_below(m, others) for m in imports_of(file)), file.relative_to(PACKAGE)


def test_no_modules_import_each_other_in_a_circle() -> None:
    """The public API is left out: it names modules of many folders, and imports each when it is used."""
    left = {
        name: set(imports_of(file)) & set(modules()) - {name} for name, file in modules().items() if name != "harness"
    }
    while free := {name for name, imported in left.items() if not imported & set(left)}:
        left = {name: imported for name, imported in left.items() if name not in free}
    while used := {name for name in left if not any(name in imported for imported in left.values())}:
        left = {name: imported for name, imported in left.items() if name not in used}
    assert not left, f"circles among {sorted(left)}"


FLOORS = {
    **{"view": 3, "commands": 3, "body": 4, "testing": 4, "bench": 5, "core": 5, "live": 5, "compare": 6, "score": 6},
    **{"calibrate": 7, "measure": 7, "mocap": 7, "results": 7, "study": 8, "report": 9, "simulate": 9},
    **{"experiment": 10, "reconstruct": 11, "stream": 13},
}
"""Most floors of a folder: a file stands one floor above the highest file of its folder that it imports."""


@pytest.mark.parametrize("folder", sorted(FOLDERS))
def test_a_folder_has_no_more_floors(folder: str) -> None:
    files = {
        name: file
        for name, file in modules().items()
        if name.startswith(f"harness.{folder}.") and file.name != "__init__.py"
    }

    @cache
    def floor(name: str) -> int:
        return 1 + max(
            (floor(other) for other in imports_of(files[name]) if other in files and other != name), default=0
        )

    assert max(map(floor, files)) <= FLOORS[folder]


def class_names() -> Iterator[tuple[str, str]]:
    for name, file in modules().items():
        yield from ((node.name, name) for node in ast.walk(tree_of(file)) if isinstance(node, ast.ClassDef))


def test_no_class_name_is_borne_twice() -> None:
    bearers: dict[str, list[str]] = {}
    for name, module in class_names():
        bearers.setdefault(name, []).append(module)
    assert not {name: found for name, found in bearers.items() if len(found) > 1}


def test_no_public_name_equals_a_folder() -> None:
    folders = FOLDERS | set(MAY_IMPORT)
    assert not folders & set(harness.__all__)
    for name, file in modules().items():
        for node in tree_of(file).body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef):
                assert node.name not in folders, f"{name}.{node.name}"


def test_no_more_files_name_the_bones_and_hinges() -> None:
    found: dict[str, int] = {}
    for file in PACKAGE.rglob("*.py"):
        nodes = list(ast.walk(tree_of(file)))
        names = {node.id for node in nodes if isinstance(node, ast.Name)}
        names |= {node.attr for node in nodes if isinstance(node, ast.Attribute)}
        names |= {alias.name for node in nodes if isinstance(node, ast.ImportFrom) for alias in node.names}
        if names & {"BONES", "HINGES"}:
            folder = file.relative_to(PACKAGE).parts[0]
            found[folder] = found.get(folder, 0) + 1
    assert not {folder: count for folder, count in found.items() if count > NAMES_BONES.get(folder, 0)}


def test_mujoco_stays_where_kinematics_live() -> None:
    for folder in FOLDERS - USES_MUJOCO:
        for file in (PACKAGE / folder).rglob("*.py"):
            assert not any(m.split(".")[0] == "mujoco" for m in imports_of(file)), file.relative_to(PACKAGE)


def test_only_the_bench_knows_mink() -> None:
    for file in PACKAGE.rglob("*.py"):
        if "bench" not in file.parts:
            assert not any(m.split(".")[0] == "mink" for m in imports_of(file)), file.relative_to(PACKAGE)


def test_one_module_writes_files_atomically_and_one_reads_toml() -> None:
    for file in PACKAGE.rglob("*.py"):
        place = file.relative_to(PACKAGE).as_posix()
        calls = {ast.unparse(node.func) for node in ast.walk(tree_of(file)) if isinstance(node, ast.Call)}
        if place not in RENAMES_FILES:
            assert not calls & {"os.replace", "os.rename", "os.fsync", "tempfile.NamedTemporaryFile"}, place
        if place != "core/parsing.py":
            assert "tomllib" not in imports_of(file), place


@pytest.mark.skipif(os.name == "nt", reason="Windows lacks these modules anyway")
def test_the_list_of_append_only_writers_is_up_to_date() -> None:
    for place in RENAMES_FILES:
        assert any(call in (PACKAGE / place).read_text() for call in ("os.replace", "os.rename", "os.fsync")), place
