"""Manifest of a run: its inputs, which must agree for two results to be comparable, and its circumstances.

Circumstances (source, options, commit, versions, machine) are what a comparison of two results is about.
"""

import os
import platform
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from functools import cache
from hashlib import blake2b
from importlib import metadata
from pathlib import Path
from typing import Any

from harness.core.fields import convert
from harness.core.files import to_json_types
from harness.core.package_data import PACKAGE_FOLDER, VERSION, data_folder
from harness.core.split import StatisticalUnit
from harness.errors import BadFile, UnknownName
from harness.results.files.digests import read_result_json
from harness.score import VERSIONS

PACKAGES = ("numpy", "scipy", "mujoco", "pyserial", "upc-pymotion", "matplotlib", "pyvista", "ezc3d", "mink")
"""Packages whose versions are listed; "absent" if not installed."""
SOURCE_SUFFIXES = frozenset({".py", ".xml", ".mcf", ".json", ".toml", ".csv", ".npz", ".txt"})
"""Endings of code and data; others are of pages and texts."""


@dataclass(frozen=True)
class Manifest:
    """Inputs and circumstances of one run or sweep."""

    inputs: Mapping[str, Any]
    """Motion, body, stations, mounts, rate, split, examples, calibration, noise, seed."""
    metric_versions: Mapping[str, int]
    circumstances: Mapping[str, Any]
    """Methods, command, source hash, commit, versions, platform."""
    performers: Mapping[str, str] | None = None
    """Performer of each test clip whose performer is known; None in manifests of versions that did not store them."""
    unit: StatisticalUnit = "performer"
    """What statistics count, as the scenario declares it."""
    date: str = ""
    """When the command was given (ISO 8601, UTC); "" in manifests that did not store it. Neither date is compared."""
    commit_date: str = ""
    """When the commit of the package was made; "" outside a checkout."""

    @property
    def training_data(self) -> Mapping[str, str]:
        """Method -> its declared training data (`core.split`); empty in manifests that did not store it."""
        return dict(self.circumstances.get("training_data", {}))

    def as_dict(self) -> dict[str, Any]:
        out: dict[str, Any] = to_json_types(asdict(self))
        return out

    @classmethod
    def read(cls, path: Path) -> "Manifest":
        """Read manifest.json; BadFile when it is missing, damaged, edited or malformed."""
        advice = "Is this a folder written by `harness run`? If so, restore it, or run again with another --out."
        content = read_result_json(path, "the manifest of a run", advice)
        try:
            inputs, versions, circumstances = (
                dict(content[name]) for name in ("inputs", "metric_versions", "circumstances")
            )
            performers = content.get("performers")
            known = None if performers is None else {str(clip): str(who) for clip, who in performers.items()}
            unit = convert(StatisticalUnit, content.get("unit", "performer"), "unit")
            dates = (str(content.get(name, "")) for name in ("date", "commit_date"))
            return cls(inputs, versions, circumstances, known, unit, *dates)
        except (KeyError, TypeError, ValueError, AttributeError, UnknownName) as error:
            advice = "Is this a folder written by `harness run`?"
            raise BadFile(path, f"no {error}", "inputs, metric_versions and circumstances", advice) from error

    def differences(self, other: "Manifest") -> list[str]:
        """Names of the inputs in which two runs differ, such as "motion.test"; empty for the same run."""
        mine, theirs = flatten(to_json_types(self.inputs)), flatten(to_json_types(other.inputs))
        return [name for name in {**mine, **theirs} if mine.get(name) != theirs.get(name)]


def describe_run(
    scenario: Mapping[str, Any],
    *,
    motion_source: str | Sequence[str],
    command: str,
    constants: Mapping[str, str] | None = None,
    training_data: Mapping[str, str] | None = None,
    performers: Mapping[str, str] | None = None,
    unit: StatisticalUnit = "performer",
) -> Manifest:
    """Manifest of running a scenario, or a sweep's scenarios, with this code on this machine.

    Methods, their `constants` and `training_data`, expected orders and omissions (`left_out`) are circumstances. The
    `unit` of statistics changes no result. All else is input.
    """
    no_inputs = ("methods", "expected_order", "left_out", "unit")
    inputs = {name: value for name, value in scenario.items() if name not in no_inputs}
    return Manifest(
        inputs={**inputs, "motion_source": motion_source},
        metric_versions=VERSIONS,
        circumstances={
            "methods": scenario.get("methods", ()),
            "constants": constants or {},
            "training_data": training_data or {},
            "left_out": scenario.get("left_out", {}),
            "command": command,
            **current_circumstances(),
        },
        performers=performers,
        unit=unit,
        date=datetime.now(UTC).isoformat(timespec="seconds"),
        commit_date=_run_git(PACKAGE_FOLDER.parent, "show", "-s", "--format=%cI", "HEAD") or "",
    )


def current_circumstances() -> dict[str, Any]:
    """Source hash, commit, versions and machine."""
    return {
        "harness": VERSION,
        "source_hash": source_hash(),
        **_commit(PACKAGE_FOLDER.parent),
        "python": platform.python_version(),
        "packages": {name: _version(name) for name in PACKAGES},
        "platform": platform.platform(),
        "processor": _processor(),
        "cpu_count": os.cpu_count(),
    }


@cache
def source_hash() -> str:
    """Hash of the files of the package that `source_files` lists, 16 hex digits."""
    state = blake2b(digest_size=8)
    for name, file in sorted(source_files().items()):
        state.update(f"{name}\0".encode())
        state.update(file.read_bytes() + b"\0")
    return state.hexdigest()


def source_files() -> dict[str, Path]:
    """Name -> path of the code and data of the package and of `models`, on which results depend.

    The files of `scenarios` are left out: a run stores the whole scenario.
    """
    shipped, models = PACKAGE_FOLDER / "share", data_folder("models")
    own = [file for file in PACKAGE_FOLDER.rglob("*") if not file.is_relative_to(shipped)]
    named = {file.relative_to(PACKAGE_FOLDER).as_posix(): file for file in own}
    named |= {f"models/{file.relative_to(models).as_posix()}": file for file in models.rglob("*")}
    return {name: file for name, file in named.items() if file.suffix in SOURCE_SUFFIXES}


def _commit(root: Path) -> dict[str, Any]:
    """Commit, and whether files differ from it, if the package lies in its own checkout."""
    status = _run_git(root, "status", "--porcelain", "--", "harness", "models", "scenarios")
    return {"commit": _run_git(root, "rev-parse", "HEAD"), "dirty": None if status is None else bool(status)}


def _run_git(root: Path, *arguments: str) -> str | None:
    """What git says of a checkout; None for a folder that is none, and where git fails or takes long."""
    git = shutil.which("git")
    if git is None or not (root / ".git").exists():
        return None
    try:
        done = subprocess.run([git, "-C", str(root), *arguments], capture_output=True, text=True, timeout=20)
    except (subprocess.TimeoutExpired, OSError):  # a busy machine: the commit stays unknown
        return None
    return done.stdout.strip() if done.returncode == 0 else None


def _processor() -> str:
    """Name and numbers of the processor; on virtual machines many kinds share a name."""
    try:
        first = Path("/proc/cpuinfo").read_text(encoding="utf-8").partition("\n\n")[0]
    except OSError:
        return platform.processor() or platform.machine()
    fields = {name.strip(): value.strip() for name, _, value in (line.partition(":") for line in first.splitlines())}
    numbers = [fields[name] for name in ("cpu family", "model", "stepping") if name in fields]
    return " ".join([fields.get("model name") or platform.machine(), *(["/".join(numbers)] if numbers else [])])


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "absent"


def flatten(content: Any, prefix: str = "") -> dict[str, Any]:
    """One flat mapping with dotted names, from nested mappings."""
    if not isinstance(content, dict) or not content:
        return {prefix: content}
    parts = [flatten(value, f"{prefix}.{name}" if prefix else name) for name, value in content.items()]
    return {name: value for part in parts for name, value in part.items()}
