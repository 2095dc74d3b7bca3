"""Files and environment variables that determine what a method computes.

Their hash is part of a cell's key. The code of a method is every module that it imports from its own package or folder,
and from other folders that hold no installed packages. Its data files are those of its attribute `files`, relative to
the file that defines the attribute. Its environment variables are those of its attribute `environment`.
"""

import ast
import hashlib
import inspect
import os
import site
import sys
import sysconfig
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from types import ModuleType
from typing import Any

from harness.core.cache_folder import cache_folder
from harness.core.input_file import check_input_file
from harness.core.package_data import PACKAGE_FOLDER
from harness.errors import BadInput
from harness.reconstruct.contract import Method

MODULE_SUFFIXES = (".py", ".pyc", *EXTENSION_SUFFIXES)
CACHE_FOLDER = "__pycache__"
"""Folders of compiled code, which is made again from its source."""
_SITE_FOLDERS = ("site-packages", "dist-packages")
_IMPORTERS = ("import_module", "__import__")


@dataclass(frozen=True)
class SourceFiles:
    """Files of one method; the package's own are left out, because every key contains their hash anyway."""

    folders: tuple[Path, ...]
    """Own folders: those of the method, and of the methods that it wraps."""
    files: tuple[Path, ...]
    """Code and declared data files."""

    def digest(self) -> str:
        """Hash of the names and contents of all files; BadInput when one cannot be read."""
        state = hashlib.blake2b(digest_size=16)
        entries = []
        for file in self.files:
            near = next((folder for folder in self.folders if file.is_relative_to(folder)), file.parent)
            try:
                with open(file, "rb") as content:
                    entries.append(
                        (file.relative_to(near).as_posix(), hashlib.file_digest(content, "blake2b").digest())
                    )
            except OSError as error:
                raise BadInput(
                    f"{file} cannot be read ({error.strerror}).", "A cell's key covers its content."
                ) from error
        for name, content_hash in sorted(entries):
            state.update(f"{name}\0".encode() + content_hash)
        return state.hexdigest()


def source_hash(method: Method, modules: Iterable[ModuleType] = ()) -> str:
    """Hash of a method's class, of the classes that it wraps, of their files and of their environment variables.

    `modules` as for `source_files`. BadInput when a file is missing.
    """
    state = hashlib.blake2b(digest_size=16)
    for part in _wrapped(method):
        state.update(f"{type(part).__module__}:{type(part).__qualname__}\0".encode())
    state.update(find_source_files(method, modules).digest().encode())
    for name in sorted(declared_environment(method)):
        state.update(f"{name}\0{os.environ.get(name)!r}\0".encode())
    return state.hexdigest()


def find_source_files(method: object, modules: Iterable[ModuleType] = ()) -> SourceFiles:
    """Files of a method and of the methods that it wraps; BadInput when one does not exist.

    `modules` are those that the method's process has loaded. Their files count, whatever way they were imported, unless
    they belong to the harness, to Python or to another installed package.
    """
    folders, roots, starts = dict[Path, None](), dict[Path, bool](), list[Path]()
    files = {file for part in _wrapped(method) for file in _declared_files(part)}

    def add(module: str, file: Path) -> None:
        if is_below(file, [PACKAGE_FOLDER]):
            return
        package = _top_package(module, file)
        root = package.parent if package else file.parent
        installed = is_below(root, library_folders())
        folders[(package or file) if installed else root] = None
        roots[root] = not installed
        starts.append(file)
        files.update([file, *_code_below(package)] if package else [file])

    for part in _wrapped(method):
        add(type(part).__module__, _defining_file(type(part)))
    own = tuple(folders)
    apart, ours = (tuple(os.path.join(folder, "") for folder in some) for some in (foreign_folders(), own))
    for module in modules:
        place = os.path.abspath(getattr(module, "__file__", None) or "")
        if place.startswith(apart) and not place.startswith(ours):  # most modules: paths would be slow
            continue
        file = _existing_file(getattr(module, "__file__", None))
        if file is not None and file not in files and (is_own(file, own) or not is_below(file, foreign_folders())):
            add(module.__name__, file)
    entries = [Path(os.path.abspath(entry)) for entry in sys.path] if any(roots.values()) else []
    entries = [path for path in entries if path.is_dir() and not is_below(path, foreign_folders())]
    roots |= {path: True for path in entries if is_below(path, roots)}
    return SourceFiles(tuple(folders), tuple(sorted(files | _imported_files(starts, roots, entries))))


def declared_environment(method: object) -> set[str]:
    """Names of the environment variables that a method and those that it wraps read; BadInput unless they are texts."""
    return {name for part in _wrapped(method) for name in _declared(part, "environment", (str,), '["GAIN"]')}


def is_below(path: Path, folders: Iterable[Path]) -> bool:
    """Whether a path is one of the folders or lies below one."""
    return any(path.is_relative_to(folder) for folder in folders)


def is_own(path: Path, folders: Iterable[Path]) -> bool:
    """Whether a path lies below one of a method's own folders, and not below a foreign folder inside that."""

    def depth(around: Iterable[Path]) -> int:
        return max((len(folder.parts) for folder in around if path.is_relative_to(folder)), default=0)

    return 0 < depth(folders) >= depth(foreign_folders())


def library_folders() -> tuple[Path, ...]:
    """Folders of the standard library and of installed packages, as named and with links resolved."""
    return _library_folders(tuple(sys.path))


@cache
def _library_folders(import_path: tuple[str, ...]) -> tuple[Path, ...]:
    named = [sysconfig.get_path(kind) for kind in ("stdlib", "platstdlib", "purelib", "platlib")]
    named += [site.getusersitepackages(), *site.getsitepackages()]
    named += [entry for entry in import_path if Path(entry).name in _SITE_FOLDERS]  # also of another environment
    return tuple(dict.fromkeys(p for name in named if name for p in (Path(name).absolute(), Path(name).resolve())))


def foreign_folders() -> tuple[Path, ...]:
    """Folders whose files are no method's own: the harness, its data and cache, Python and installed packages."""
    return _foreign_folders(library_folders())


@cache
def _foreign_folders(libraries: tuple[Path, ...]) -> tuple[Path, ...]:
    ours = [PACKAGE_FOLDER, *(PACKAGE_FOLDER.parent / name for name in ("models", "scenarios"))]
    ours += [folder for folder in [cache_folder()] if folder is not None]
    python = [Path(prefix) for prefix in (sys.prefix, sys.base_prefix)]
    return tuple(dict.fromkeys([*ours, *python, *(p.resolve() for p in (*ours, *python)), *libraries]))


def _wrapped(method: object) -> Iterator[object]:
    """A method, the one that it wraps, and so on."""
    while hasattr(method, "fit"):
        yield method
        method = getattr(method, "method", None)


def _defining_file(kind: type) -> Path:
    try:
        found = inspect.getsourcefile(kind)
    except TypeError:
        found = None
    if found is None or not Path(found).is_file():
        raise BadInput(f"The source of {kind.__name__} cannot be found.", "Define the method in a file.")
    return Path(os.path.abspath(found))


def _top_package(module: str, file: Path) -> Path | None:
    """The folder of the outermost package of a module; None for a module outside packages."""
    top = sys.modules.get(module.partition(".")[0])
    places = [Path(os.path.abspath(place)) for place in getattr(top, "__path__", ())]
    return next((place for place in places if file.is_relative_to(place)), None)


def _existing_file(path: str | None) -> Path | None:
    """The file of a module, or the archive that holds it; None for a module without either."""
    if path is None:
        return None
    place = Path(os.path.abspath(path))
    return next((around for around in (place, *place.parents) if around.is_file()), None)


def _code_below(folder: Path) -> set[Path]:
    found = (file for suffix in MODULE_SUFFIXES for file in folder.rglob(f"*{suffix}"))
    return {file for file in found if CACHE_FOLDER not in file.parts and file.is_file()}


def _imported_files(starts: Iterable[Path], roots: Mapping[Path, bool], others: Sequence[Path]) -> set[Path]:
    """The files of the modules that files import from some folders, recursively.

    A value of `roots` tells whether packages in that folder count: among installed ones, only modules in it do. What
    lies in none of the roots is looked for in `others`, and the first one that has it counts.
    """
    found, waiting = set[Path](), list(starts)
    while waiting:
        current = waiting.pop()
        if current in found:
            continue
        found.add(current)
        if current.suffix != ".py":
            continue
        for name in {name for root in (*roots, *others) for name in _imported_names(current, root)}:
            parts = [file for place, deep in roots.items() for file in _module_files(place, name, deep)]
            elsewhere = (files for place in others if (files := list(_module_files(place, name, packages=True))))
            waiting += [part for part in parts or next(elsewhere, []) if _is_followed(part, roots)]
    return found


def _is_followed(file: Path, roots: Mapping[Path, bool]) -> bool:
    if is_below(file, [PACKAGE_FOLDER]):
        return False
    return is_own(file, roots) or not is_below(file, foreign_folders())


def _imported_names(file: Path, root: Path) -> Iterator[str]:
    """Names of the modules that a file may import, wherever in the file; relative ones are made absolute."""
    try:
        nodes = list(ast.walk(ast.parse(file.read_bytes())))
    except (SyntaxError, ValueError, RecursionError):
        return  # it cannot be imported either; its content counts
    package = file.parent.relative_to(root).parts if file.is_relative_to(root) else ()
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else ()
            base = ".".join([*above, *([node.module] if node.module else [])])
            yield from (base, *(f"{base}.{alias.name}".lstrip(".") for alias in node.names))
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", getattr(node.func, "id", "")) in _IMPORTERS:
            yield from (a.value for a in node.args[:1] if isinstance(a, ast.Constant) and isinstance(a.value, str))


def _module_files(root: Path, name: str, packages: bool) -> Iterator[Path]:
    """Files of a module and of the packages around it, as far as they lie below a folder."""
    parts = [part for part in name.split(".") if part.isidentifier()]
    for count in range(1, len(parts) + 1 if packages else min(len(parts), 1) + 1):
        place = root.joinpath(*parts[:count])
        for stem in (place, *([place / "__init__"] if packages else [])):
            candidates = (stem.with_name(stem.name + suffix) for suffix in MODULE_SUFFIXES)
            yield from (file for file in candidates if file.is_file())


def _declared_files(method: object) -> Iterator[Path]:
    """The files of a method's attribute `files`; a folder stands for all files below it."""
    owner = next((kind for kind in type(method).__mro__ if "files" in vars(kind)), type(method))
    for name in _declared(method, "files", (str, Path), '["a.npz"]'):
        path = Path(os.path.abspath(_defining_file(owner).parent / name))
        if not path.exists():
            raise BadInput(f"{type(method).__name__} declares {path}, which does not exist.", "Correct `files`.")
        for file in sorted(path.rglob("*")) if path.is_dir() else (path,):
            if file.exists() and not file.is_dir():
                check_input_file(file, f"a data file of {type(method).__name__}", sys.maxsize, "Correct `files`.")
                yield file


def _declared(method: object, attribute: str, kinds: tuple[type, ...], example: str) -> Sequence[Any]:
    """A list that a method declares in an attribute; BadInput for anything else."""
    declared = getattr(method, attribute, ())
    if not isinstance(declared, list | tuple) or not all(isinstance(name, kinds) for name in declared):
        what = "paths" if attribute == "files" else "names"
        raise BadInput(
            f"{type(method).__name__}.{attribute} is {declared!r}.", f"Write a list of {what}: {attribute} = {example}."
        )
    return declared
