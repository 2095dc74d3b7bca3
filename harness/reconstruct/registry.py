"""Registry of methods by name: built-in ones, those of installed packages, and any class as `module:Class`.

A package registers methods in the entry-point group `harness.methods`: name -> a callable that makes the method.
`+ik` after a name adds final inverse kinematics (`clean_up`). Options follow in brackets (`harness.core.options`).
"""

import dataclasses
import importlib
import importlib.util
import inspect
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from difflib import SequenceMatcher
from functools import partial
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, cast

from harness.core.fields import replace_fields
from harness.core.options import parse_name, split_outside_brackets
from harness.core.working_folder import name_module, served_folders
from harness.errors import BadInput, HarnessError, RenamedKey, UnknownName
from harness.reconstruct.contract import Method
from harness.reconstruct.methods import dynamic_map, expert_map, ik, kernel_cca, local_pca, local_regression
from harness.reconstruct.methods.best_match import BestMatch
from harness.reconstruct.methods.clean_up import SUFFIX, CleanUp
from harness.reconstruct.methods.kernel_ridge import KernelRidge
from harness.reconstruct.methods.mean_pose import MeanPose
from harness.reconstruct.methods.ridge import Ridge

GROUP = "harness.methods"
"""Entry-point group of installed packages."""
_REQUIRED_ATTRIBUTES = ("name", "summary", "needs_examples", "fit")
"""Attributes that every method has."""
_NO_OPTIONS = (*_REQUIRED_ATTRIBUTES, "files", "environment", "source", "training_data")
"""Attributes of a method that are no options."""


_BUILT_IN: dict[str, Callable[[], Method]] = {
    "ik": ik.Ik,
    "ik:previous": lambda: ik.PREVIOUS,
    "ik:mean": lambda: ik.MEAN,
    "ik:gaussian": lambda: ik.GAUSSIAN,
    "mean_pose": MeanPose,
    "ridge": Ridge,
    "kernel_ridge": KernelRidge,
    "best_match": BestMatch,
    "local_pca": local_pca.LocalPca,
    "local_pca:chai2005": lambda: local_pca.CHAI2005,
    "dynamic_map": dynamic_map.DynamicMap,
    "dynamic_map:window": lambda: dynamic_map.WINDOW,
    "dynamic_map:literal": lambda: dynamic_map.LITERAL,
    "expert_map": expert_map.ExpertMap,
    "weighted_blend": local_regression.WeightedBlend,
    "weighted_blend:literal": lambda: local_regression.LITERAL,
    "kernel_cca": kernel_cca.KernelCca,
    "kernel_cca:literal": lambda: kernel_cca.LITERAL,
}


def list_methods() -> dict[str, Callable[[], Method]]:
    """Name -> factory of all registered methods. Installed packages cannot replace a built-in name."""
    return {entry.name: partial(_make_installed, entry) for entry in entry_points(group=GROUP)} | _BUILT_IN


def is_built_in(name: str) -> bool:
    """Whether a name with options stands for code of this package alone; nothing is imported to tell."""
    plain = without_options(name).partition("+")[0]
    return plain in _BUILT_IN or plain.partition(":")[0].partition(".")[0] == "harness"


def defining_module(name: str) -> str:
    """The module in which `resolve` finds a method that is no built-in one; nothing is imported to tell."""
    plain = without_options(name).partition("+")[0]
    registered = {entry.name: entry.value for entry in entry_points(group=GROUP)}
    return registered.get(plain, plain).partition(":")[0]


_ORIGINS = {
    "ik": "docs/papers.md C1",
    "best_match": "Slyper & Hodgins 2008, who play the nearest example",
    "ridge": "ridge regression, Hoerl & Kennard 1970",
    "kernel_ridge": "kernel ridge regression, Saunders et al. 1998",
    "local_pca": "Chai & Hodgins 2005, as Liu et al. 2011 compare with it",
    "dynamic_map": "Liu et al. 2011, eq. 2 to 14",
    "expert_map": "tabulated local experts; the prediction and likelihood of Liu et al. 2011",
    "weighted_blend": "Kim et al. 2012, what they compare with",
    "kernel_cca": "Kim et al. 2012, eq. 2 to 6",
}


def method_origin(name: str) -> str:
    """Source of a method: its optional attribute `source`, else that of the built-in method that it presets."""
    return str(getattr(make_method(name), "source", "") or _ORIGINS.get(name.partition(":")[0], ""))


def make_method(name: str) -> Method:
    """The method of a name with options, such as `local_pca[neighbours=100]+ik`; UnknownName, RenamedKey, BadInput."""
    base, *suffixes = split_outside_brackets(name, "+")
    plain, options = parse_name(base)
    method = with_options(_base_method(plain), options, base)
    for suffix in suffixes:
        plain, options = parse_name(suffix)
        if f"+{plain}" != SUFFIX:
            raise UnknownName("method", name, list_methods())
        method = with_options(CleanUp(method), options, method.name + SUFFIX)
    return method


def without_options(name: str) -> str:
    """The name without options: `local_pca[neighbours=100]+ik` becomes `local_pca+ik`."""
    return "+".join(parse_name(part)[0] for part in split_outside_brackets(name, "+"))


def with_options(method: Method, options: Mapping[str, Any], name: str) -> Method:
    """A copy of a method with this name and other options, the fields of its dataclass.

    UnknownName for an option that does not exist, RenamedKey for an old name, BadInput for a bad value.
    """
    if not options:
        return method
    if not dataclasses.is_dataclass(method) or isinstance(method, type):
        raise BadInput(f"{method.name} takes no options.", "Options are the fields of a method's dataclass.")
    fields = [field.name for field in dataclasses.fields(method) if field.init]
    option_names = [field for field in fields if field not in _NO_OPTIONS]
    renamed: Mapping[str, str] = getattr(method, "RENAMED_KEYS", {})
    for option in options:
        if option in renamed:
            raise RenamedKey(f"option of {method.name}", option, renamed[option])
        if option not in option_names:
            raise UnknownName(f"option of {method.name}", option, option_names)
    try:
        copy = replace_fields(method, options, method.name, infinite=True)
        return cast(Method, dataclasses.replace(copy, name=name) if "name" in fields else copy)
    except HarnessError:
        raise
    except Exception as error:  # code from outside may raise anything
        raise BadInput(f"{error}.", f"Options of {method.name}: {', '.join(option_names)}.") from error


def _make_installed(entry: EntryPoint) -> Method:
    """The method of an installed package, which is imported only now; BadInput when that fails."""
    with _refused(f"{entry.name} ({entry.value})", "Repair or remove the package that registers it."):
        method: Method = entry.load()()
    return method


@contextmanager
def _refused(what: str, advice: str) -> Iterator[None]:
    """BadInput where code from outside raises anything but our own errors."""
    try:
        yield
    except HarnessError:
        raise
    except (Exception, SystemExit) as error:
        raise BadInput(f"{what} cannot be made: {type(error).__name__}: {error}.", advice) from error


def _base_method(name: str) -> Method:
    """The method of a name without options or suffix; UnknownName, BadInput."""
    registered = list_methods()
    if name in registered:
        return registered[name]()
    module, colon, attribute = name.partition(":")
    name_module(module)
    if not colon or (module in registered and not _module_exists(module)):
        raise UnknownName("method", name, [*registered, *([f"{name}:CLASS"] if name in _modules_served() else [])])
    if not _module_exists(module):
        where = " or ".join([*served_folders(), "the installed packages"])
        raise UnknownName(f"module in {where}", module, _modules_served())
    with _refused(name, "It must import, and need no arguments."):
        content = importlib.import_module(module)
        if not hasattr(content, attribute):
            raise UnknownName(
                f"method in {content.__file__ or module}", attribute, _methods_defined(content, attribute)
            )
        method: Method = getattr(content, attribute)()
    missing = [m for m in _REQUIRED_ATTRIBUTES if not hasattr(method, m)]
    if missing:
        raise BadInput(
            f"{name} is not a method: it has no {' and no '.join(missing)}.", "See harness.reconstruct.contract.Method."
        )
    return method


def summary(name: str) -> str:
    """Description of a method in one line."""
    return make_method(name).summary


def _module_exists(module: str) -> bool:
    try:
        return importlib.util.find_spec(module) is not None
    except (ImportError, ValueError):
        return False


def _modules_served() -> list[str]:
    """Modules of the working folder, and of others in which a user's methods may lie."""
    return sorted(file.stem for folder in served_folders() for file in Path(folder).glob("*.py"))


def _methods_defined(module: ModuleType, near: str) -> list[str]:
    """Classes with `fit` and functions without arguments that a module defines, the nearest to a name first."""
    package = module.__name__.partition(".")[0]

    def is_method(what: Any) -> bool:
        if str(getattr(what, "__module__", "")).partition(".")[0] != package:
            return False
        return hasattr(what, "fit") or (inspect.isfunction(what) and not what.__code__.co_argcount)

    defined = [name for name, what in vars(module).items() if is_method(what)]
    return sorted(defined, key=lambda name: -SequenceMatcher(None, near, name).ratio())
