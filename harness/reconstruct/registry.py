"""Methods by name: the built-in ones, those of installed packages, and anyone's own as `module:Class`.

A package adds its own through the entry-point group `harness.methods`: name -> a callable that makes the method.
`+ik` after a name adds the final clean-up of `clean_up`.
"""

import ast
import hashlib
import importlib
import importlib.util
import inspect
import sys
from collections.abc import Callable
from importlib.metadata import entry_points
from pathlib import Path

from harness.errors import BadInput, HarnessError, UnknownName
from harness.reconstruct import ik
from harness.reconstruct.best_match import BestMatch
from harness.reconstruct.clean_up import SUFFIX, CleanUp
from harness.reconstruct.contract import Method
from harness.reconstruct.kernel_ridge import KernelRidge
from harness.reconstruct.mean_pose import MeanPose

GROUP = "harness.methods"


def methods() -> dict[str, Callable[[], Method]]:
    """Everything that can be named, but for `module:Class` and `+ik`; packages may not take a built-in name."""
    known: dict[str, Callable[[], Method]] = {entry.name: entry.load() for entry in entry_points(group=GROUP)}
    return known | {
        "ik": ik.Ik,
        "ik:gaussian": lambda: ik.GAUSSIAN,
        "ik:mean": lambda: ik.MEAN,
        "mean_pose": MeanPose,
        "kernel_ridge": KernelRidge,
        "best_match": BestMatch,
    }


def resolve(name: str) -> Method:
    """The method of that name with its default options; UnknownName, BadInput for what is not a method."""
    if name.endswith(SUFFIX):
        return CleanUp(resolve(name.removesuffix(SUFFIX)))
    known = methods()
    if name in known:
        return known[name]()
    module, colon, attribute = name.partition(":")
    if not colon or not attribute or module in known or not _exists(module):
        raise UnknownName("method", name, known)
    try:
        found = getattr(importlib.import_module(module), attribute, None)
        if found is None:
            raise UnknownName(f"method in {module}", attribute, _public(module))
        method: Method = found()
    except HarnessError:
        raise
    except (Exception, SystemExit) as error:  # anyone's own code may raise anything
        raise BadInput(
            f"{name} cannot be made: {type(error).__name__}: {error}.", "Does it import, and need no arguments?"
        ) from error
    missing = [m for m in ("name", "summary", "needs_examples", "fit") if not hasattr(method, m)]
    if missing:
        raise BadInput(
            f"{name} is not a method: it has no {' and no '.join(missing)}.",
            "See harness.reconstruct.contract.Method.",
        )
    return method


def summary(name: str) -> str:
    """The method's line in lists."""
    return resolve(name).summary


def source_hash(method: Method) -> str:
    """A digest of the files that define the method and what it wraps; BadInput when there are none to read."""
    digest = hashlib.blake2b(digest_size=16)
    inner: object = method
    while inner is not None:
        file = inspect.getsourcefile(type(inner))
        if file is None or not Path(file).is_file():
            raise BadInput(f"The source of {method.name} cannot be found.", "Define the method in a file.")
        for part in [Path(file), *_sources(type(inner).__module__, Path(file))]:
            digest.update(part.name.encode() + b"\0" + part.read_bytes())
        inner = getattr(inner, "method", None)
    return digest.hexdigest()


def _sources(module: str, file: Path) -> list[Path]:
    """A method's file and its own others: all of its package, or what a lone file imports from its folder."""
    top = sys.modules.get(module.partition(".")[0])
    if top is not None and hasattr(top, "__path__"):
        return sorted(part for folder in top.__path__ for part in Path(folder).rglob("*.py"))
    found, waiting = set(), [file]
    while waiting:
        if (part := waiting.pop()) not in found:
            found.add(part)
            nodes = list(ast.walk(ast.parse(part.read_bytes())))
            names = [a.name for node in nodes if isinstance(node, ast.Import) for a in node.names]
            names += [node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)]
            beside = [part.parent / f"{name.partition('.')[0]}.py" for name in names]
            waiting += [other for other in beside if other.is_file()]
    return sorted(found)


def _exists(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except (ImportError, ValueError):
        return False


def _public(module: str) -> list[str]:
    return sorted(name for name, what in vars(importlib.import_module(module)).items() if inspect.isclass(what))
