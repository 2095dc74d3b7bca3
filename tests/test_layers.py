"""Which folder may import which: the table of the architecture, read off the source."""

import ast
from pathlib import Path

import pytest

import harness

PACKAGE = Path(harness.__file__).parent
EVERYTHING = {p.name for p in PACKAGE.iterdir() if p.is_dir() and (p / "__init__.py").exists()}

# `core` and `errors` are open to all and not listed. The truth wall: methods see no simulation, motion file or score.
MAY_IMPORT: dict[str, set[str]] = {
    "core": set(),
    "mocap": set(),
    "body": set(),
    "stream": set(),
    "simulate": {"body", "stream"},
    "calibrate": {"body", "stream"},
    "reconstruct": {"body", "stream", "calibrate"},
    "score": set(),
    "report": {"score", "body"},
    # writes BVH as an export does; there is no truth in a live session that its wall would have to hide
    "live": {"stream", "calibrate", "reconstruct", "body", "mocap"},
    # the bench measures what the tables do
    "bench": (EVERYTHING | {"cells", "config", "contest", "setting", "progress", "rehearsal", "trials"})
    - {"study", "testing", "commands"},
    # many runs and what they come to
    "study": (EVERYTHING | {"cells", "config", "contest", "experiment", "progress", "setting", "trials"})
    - {"bench", "testing", "commands"},
    # runs a method where a baseline was measured
    "testing": (EVERYTHING | {"config", "experiment"}) - {"study", "bench", "commands"},
    "commands": EVERYTHING
    | {
        "calibration_trial",
        "catalogue",
        "cells",
        "config",
        "doctor",
        "experiment",
        "posing",
        "progress",
        "recorded",
        "rehearsal",
    },
}
TOP = {
    "calibrated",
    "calibration_trial",
    "cells",
    "cli",
    "catalogue",
    "config",
    "contest",
    "doctor",
    "errors",
    "experiment",
    "posing",
    "progress",
    "pytest",
    "recorded",
    "rehearsal",
    "setting",
    "trials",
    "__init__",
    "__main__",
}
USES_MUJOCO = {"body", "simulate", "bench"}


def imports_of(file: Path) -> set[str]:
    """Every module that a file imports, wherever in the file."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names} | {str(node.module)}
    return found


def layer_of(module: str) -> str | None:
    parts = module.split(".")
    return parts[1] if parts[0] == "harness" and len(parts) > 1 else None


def test_the_table_names_every_folder() -> None:
    assert set(MAY_IMPORT) == EVERYTHING
    assert {p.stem for p in PACKAGE.glob("*.py")} <= TOP


@pytest.mark.parametrize("folder", sorted(MAY_IMPORT))
def test_a_folder_imports_only_what_it_may(folder: str) -> None:
    allowed = MAY_IMPORT[folder] | {folder, "core", "errors", None, "__version__"}
    files = list((PACKAGE / folder).rglob("*.py"))
    assert files
    for file in files:
        seen = {layer_of(module) for module in imports_of(file)}
        assert seen <= allowed, f"{file.relative_to(PACKAGE)} imports {sorted(map(str, seen - allowed))}"


def test_mujoco_stays_where_kinematics_live() -> None:
    for folder in EVERYTHING - USES_MUJOCO:
        for file in (PACKAGE / folder).rglob("*.py"):
            assert not any(m.split(".")[0] == "mujoco" for m in imports_of(file)), file.relative_to(PACKAGE)


def test_only_the_bench_knows_mink() -> None:
    for file in PACKAGE.rglob("*.py"):
        if "bench" not in file.parts:
            assert not any(m.split(".")[0] == "mink" for m in imports_of(file)), file.relative_to(PACKAGE)
