"""A motion library: motion files in one or several folders, found by clip name and loaded on request.

A clip's name is its subject and trial, such as "13_17". Copies in several formats share the name; the format that
says most is loaded: AMC (with its ASF), then BVH, MVNX and AMASS npz. C3D files are listed, but hold markers instead of
the motion of a skeleton. What the files do not say (behaviour, rate) comes from the index of each folder
(`harness.mocap.index`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from filecmp import cmp
from pathlib import Path

from harness.core.motion import Clip
from harness.errors import BadInput, UnknownName
from harness.mocap.clip_file import CMU_NAME, FORMATS, clip_name, read_library_file
from harness.mocap.folder_scan import scan_folder
from harness.mocap.index import INDEX_NAME, read_index
from harness.mocap.read.file_checks import check_size

LibraryFolders = Path | str | Sequence[Path | str]
"""One folder, or several."""


@dataclass(frozen=True)
class LibraryEntry:
    """One clip of a library: its preferred file, and what the index says about it."""

    name: str
    format: str
    """`amc`, `bvh`, `mvnx`, `npz` or `c3d`."""
    path: Path
    subject: str
    behaviour: str = ""
    frames: int | None = None
    rate_hz: float | None = None
    """Frame rate in the index [Hz]; the rate in a file itself goes before it."""
    note: str = ""
    copies: tuple[Path, ...] = ()
    """Further files of the clip, in other formats or places."""

    def as_dict(self) -> dict[str, object]:
        """The fields for JSON; paths as text."""
        return asdict(self) | {"path": str(self.path), "copies": [str(path) for path in self.copies]}

    def line(self) -> str:
        """One line for a list on a terminal."""
        frames = "?" if self.frames is None else str(self.frames)
        rate = "? Hz" if self.rate_hz is None else f"{self.rate_hz:g} Hz"
        words = f"{self.name:<10} {self.format:<4} {self.behaviour or '?':<14} {frames:>6} frames at {rate}"
        return f"{words}  {self.note}".rstrip()


class UnknownClip(UnknownName):
    """A clip that a library does not hold. The message names the links and folders that were ignored."""

    def __init__(self, name: str, known: Sequence[str], ignored_paths: Sequence[str] = ()) -> None:
        super().__init__("clip", name, known)
        self.args = name, tuple(known), tuple(ignored_paths)
        self.ignored_paths = tuple(ignored_paths)

    def __str__(self) -> str:
        return " ".join([super().__str__(), *ignored_paths_note(self.ignored_paths)])


def ignored_paths_note(paths: Sequence[Path | str]) -> list[str]:
    """A sentence that names the ignored links and folders of a library; [] if there are none."""
    if not paths:
        return []
    names = ", ".join(map(str, paths))
    return [f"Ignored links that lead outside the library's folder or to nothing, and unreadable folders: {names}."]


class MotionLibrary:
    """The clips in one or several folders, at any depth.

    A name that two folders hold must stand for identical files; the index of the first folder counts.
    """

    def __init__(self, folders: LibraryFolders, *, rate_hz: float | None = None) -> None:
        """`rate_hz` is the rate of AMC files whose rate no index names [Hz].

        Raises BadInput for a path that is no folder and for a name that stands for different motions in two folders,
        BadFile for an index that cannot be read.
        """
        self.folders = as_folders(folders)
        self._rate_hz = rate_hz
        self._entries: dict[str, LibraryEntry] = {}
        self._folder_of: dict[str, Path] = {}
        ignored: list[Path] = []
        for folder in self.folders:
            entries, paths = _scan_entries(folder.resolve())
            ignored += paths
            for entry in entries.values():
                self._add(entry, folder)
        self._entries = dict(sorted(self._entries.items()))
        self.ignored_paths = tuple(ignored)
        """Symbolic links that lead outside their library folder or to nothing, and folders that cannot be read."""

    def _add(self, entry: LibraryEntry, folder: Path) -> None:
        other = self._entries.get(entry.name)
        motions = other is not None and "c3d" not in (entry.format, other.format)
        if other is not None and motions:
            check_size(entry.path, "a motion file")
        if other is not None and motions and not cmp(other.path, entry.path, shallow=False):
            raise BadInput(
                f"The clip {entry.name} differs between two folders: {other.path} and {entry.path}.",
                "Rename or remove one of them, or name only one of the folders.",
            )
        if other is None or (other.format == "c3d" and entry.format != "c3d"):
            best, rest, self._folder_of[entry.name] = entry, other, folder
        else:
            best, rest = other, entry
        copies = () if rest is None else (rest.path, *rest.copies)
        self._entries[entry.name] = replace(best, copies=(*best.copies, *copies))

    def entries(self) -> tuple[LibraryEntry, ...]:
        """Every clip, sorted by name."""
        return tuple(self._entries.values())

    def names(self) -> tuple[str, ...]:
        """Names of the clips that `load` can load."""
        return tuple(entry.name for entry in self.entries() if entry.format != "c3d")

    def entry(self, name: str) -> LibraryEntry:
        """The entry of a clip; UnknownName if the library has no such clip."""
        if name not in self._entries:
            raise UnknownClip(name, tuple(self._entries), tuple(map(str, self.ignored_paths)))
        return self._entries[name]

    def load(self, name: str) -> Clip:
        """The clip in world axes with unwrapped angles: an AMC on its own skeleton (30 bones), others on the 24 bones.

        Raises UnknownName, BadFile, and BadInput where the rate is unknown or the file holds markers only.
        """
        entry, folder = self.entry(name), self._folder_of[name]
        clip = read_library_file(entry.path, folder.resolve(), entry.rate_hz or self._rate_hz)
        return replace(
            clip,
            name=entry.name,
            subject=entry.subject,
            source="cmu" if CMU_NAME.fullmatch(entry.name) else folder.name,
            behaviour=entry.behaviour,
            notes=(entry.note, *clip.notes) if entry.note else clip.notes,
        )


def absolute_folders(folders: LibraryFolders) -> tuple[Path, ...]:
    """The folders as absolute paths; they need not exist."""
    return tuple(Path(folder).absolute() for folder in ([folders] if isinstance(folders, Path | str) else folders))


def as_folders(folders: LibraryFolders) -> tuple[Path, ...]:
    """The folders as a tuple of paths, each once; BadInput for none, and for a path that is no folder."""
    paths = tuple(dict.fromkeys(map(Path, [folders] if isinstance(folders, Path | str) else folders)))
    if not paths:
        raise BadInput("No folder of a motion library is named.", "Name one with --mocap DIR.")
    for path in paths:
        if not path.is_dir():
            raise BadInput(f"{path} is no folder.", "Name the folder of a motion library.")
    return paths


def _scan_entries(top: Path) -> tuple[dict[str, LibraryEntry], tuple[Path, ...]]:
    """Entries by clip name, and the ignored paths, of a resolved folder."""
    index = read_index(top / INDEX_NAME)
    rows = {(top / path).resolve(): row for path, row in index.items()}
    scan = scan_folder(top, {f".{kind}" for kind in FORMATS})
    files: dict[str, list[Path]] = {}
    for path in scan.files:
        files.setdefault(clip_name(path), []).append(path)
    entries = {}
    for name in sorted(files):
        best, *others = sorted(files[name], key=lambda path: (FORMATS.index(path.suffix.lower().lstrip(".")), path))
        row = index.get(best.relative_to(top).as_posix()) or rows.get(best.resolve(), {})
        entries[name] = _make_entry(name, best, tuple(others), row)
    return entries, scan.ignored_paths


def _make_entry(name: str, path: Path, copies: tuple[Path, ...], row: Mapping[str, str]) -> LibraryEntry:
    return LibraryEntry(
        name=name,
        format=path.suffix.lower().lstrip("."),
        path=path,
        subject=row.get("subject") or name.split("_", 1)[0],
        behaviour=row.get("behaviour") or "",
        frames=int(row["frames"]) if row.get("frames") else None,
        rate_hz=float(row["fps"]) if row.get("fps") else None,
        note=row.get("note") or "",
        copies=copies,
    )
