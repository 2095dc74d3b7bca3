"""A motion library: motion files in one or several folders, found by clip name and loaded on request.

A clip is one take: files of the same bytes, files of one folder and name in several formats, and files that CMU's
subject and trial name, in several formats anywhere. The format that says most is loaded: AMC (with its ASF), then BVH,
MVNX and AMASS npz. C3D files are listed, but hold markers instead of the motion of a skeleton. Files of one name whose
rows in the index name different subjects or rates are different takes. What the files do not say (behaviour, rate)
comes from the index of each folder (`harness.mocap.index`).

A clip's name is the stem of its file, such as "13_17". Where several takes have it, each is named by its path in the
library: "Anna/take_001", "Bert/take_001".
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from filecmp import cmp
from pathlib import Path

from harness.core.motion import Clip
from harness.errors import BadFile, BadInput, UnknownName, shorten
from harness.mocap.clip_file import CLIP_FORMATS, CMU_NAME, clip_name, read_library_file
from harness.mocap.index import INDEX_NAME, index_key, read_index, scan_folder

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
    subject_known: bool = True
    """Whether the index or CMU's name tells the subject; otherwise it is a part of the path."""

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
    """A sentence that names the ignored links, folders and files of a library; [] if there are none."""
    if not paths:
        return []
    what = "links that lead outside the library's folder or to nothing, unreadable folders, control characters in names"
    return [f"Ignored ({what}): {shorten(', '.join(map(str, paths)), 1000)}."]


class MotionLibrary:
    """The clips in one or several folders, at any depth.

    A short name that two folders hold must stand for one take; the index of the first folder counts.
    """

    def __init__(self, folders: LibraryFolders, *, rate_hz: float | None = None) -> None:
        """`rate_hz` is the rate of AMC files whose rate no index names [Hz].

        Raises BadInput for a path that is no folder and for a name that stands for different motions in two folders,
        BadFile for an index that cannot be read.
        """
        self.folders = as_folders(folders)
        self._rate_hz = rate_hz
        files: dict[str, list[_File]] = {}
        ignored: list[Path] = []
        for folder in self.folders:
            found, paths = _scan_files(folder)
            ignored += paths
            for file in found:  # folders of a library may contain each other
                if all(file.path != other.path for other in files.get(clip_name(file.path), ())):
                    files.setdefault(clip_name(file.path), []).append(file)
        self._takes: dict[str, list[_File]] = {}
        self._choices: dict[str, tuple[str, ...]] = {}
        """Short name -> the names of its takes, where it has several."""
        for name, same in files.items():
            named = _name_takes(name, _group_takes(same))
            self._takes |= named
            if name not in named:
                self._choices[name] = tuple(sorted(named))
        self._takes = dict(sorted(self._takes.items()))
        performers = {Path(name).parent.as_posix() for names in self._choices.values() for name in names}
        self._entries = {name: _make_entry(name, take, performers) for name, take in self._takes.items()}
        self.ignored_paths = tuple(ignored)
        """Symbolic links that lead outside their library folder or to nothing, folders that cannot be read, and files
        with a control character in their path."""

    def entries(self) -> tuple[LibraryEntry, ...]:
        """Every clip, sorted by name."""
        return tuple(self._entries.values())

    def names(self) -> tuple[str, ...]:
        """Names of the clips that `load` can load."""
        return tuple(entry.name for entry in self.entries() if entry.format != "c3d")

    def entry(self, name: str) -> LibraryEntry:
        """The entry of a clip; UnknownName if the library has no such clip, BadInput if it has several."""
        if name not in self._entries:
            if name in self._choices:
                raise BadInput(
                    f"The clip name {name!r} stands for {len(self._choices[name])} different takes.",
                    f"Name one of {', '.join(self._choices[name])}.",
                )
            raise UnknownClip(name, tuple(self._entries), tuple(map(str, self.ignored_paths)))
        return self._entries[name]

    def load(self, name: str) -> Clip:
        """The clip in world axes with unwrapped angles: an AMC on its own skeleton (30 bones), others on the 24 bones.

        Raises UnknownName, BadFile, and BadInput where the rate is unknown or the file holds markers only.
        """
        entry = self.entry(name)
        folder = self._takes[name][0].folder
        clip = read_library_file(entry.path, folder.resolve(), entry.rate_hz or self._rate_hz)
        if entry.format == "amc" and entry.frames not in (None, len(clip)):  # the other formats have a count or an end
            expected, advice = f"{entry.frames}, as {INDEX_NAME} says", "The file is truncated, or its row is wrong."
            raise BadFile(entry.path, f"{len(clip)} frames", expected, advice)
        return replace(
            clip,
            name=entry.name,
            subject=entry.subject,
            source="cmu" if CMU_NAME.fullmatch(clip_name(entry.path)) else folder.name,
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


@dataclass(frozen=True)
class _File:
    """A motion file of a library."""

    path: Path
    folder: Path
    """The library's folder, as it was named."""
    place: str
    """Path in the folder, without the ending of the format."""
    row: Mapping[str, str]
    """Row of the folder's index; empty without one."""

    @property
    def format(self) -> str:
        return self.path.suffix.lower().lstrip(".")

    @property
    def ending(self) -> str:
        """What the file's name has beyond that of the clip, such as ".bvh" and "_poses.npz"."""
        return self.path.name.removeprefix(clip_name(self.path)).lower()

    def contradicts(self, other: "_File") -> bool:
        """Whether the index names another subject or rate for the other file."""
        subjects = {row["subject"] for row in (self.row, other.row) if row.get("subject")}
        rates_hz = {float(row["fps"]) for row in (self.row, other.row) if row.get("fps")}
        return len(subjects) > 1 or len(rates_hz) > 1

    def is_take_of(self, take: Sequence["_File"], same_place: bool) -> bool:
        """Whether this is a take in another format: by CMU's subject and trial, or at the same place."""
        known = any(file.place == self.place for file in take) if same_place else CMU_NAME.fullmatch(self.path.stem)
        return bool(known) and not any(file.ending == self.ending or self.contradicts(file) for file in take)


def _scan_files(folder: Path) -> tuple[list[_File], tuple[Path, ...]]:
    """The motion files of a library's folder, and its ignored paths."""
    top = folder.resolve()
    index = read_index(top / INDEX_NAME)
    rows = {(top / path).resolve(): row for path, row in index.items()}
    paths, ignored = scan_folder(top, {f".{kind}" for kind in CLIP_FORMATS})
    files = []
    for path in paths:
        inside = path.relative_to(top)
        if not str(inside).isprintable():  # no command line could name it
            ignored.append(path)
            continue
        row = index.get(index_key(inside)) or rows.get(path.resolve(), {})
        files.append(_File(path, folder, inside.with_name(clip_name(path)).as_posix(), row))
    return files, tuple(ignored)


def _group_takes(files: Sequence[_File]) -> list[list[_File]]:
    """Files of one name by take, the preferred file of each first."""
    takes: list[list[_File]] = []
    for file in sorted(files, key=lambda file: CLIP_FORMATS.index(file.format)):
        same = [take for take in takes if any(_is_same(file, other) for other in take)]
        for same_place in (True, False):
            same = same or [take for take in takes if file.is_take_of(take, same_place)]
        if len(same) == 1:
            same[0].append(file)
        else:
            takes.append([file])
    return takes


def _is_same(file: _File, other: _File) -> bool:
    """Whether two files have the same bytes and the same skeleton, rate and subject."""
    if file.format != other.format or file.contradicts(other):
        return False
    return file.path.resolve() == other.path.resolve() or cmp(file.path, other.path, shallow=False)


def _name_takes(name: str, takes: list[list[_File]]) -> dict[str, list[_File]]:
    """The takes by name: `name` for the only one with motion, else each by its path in the library.

    BadInput where takes with motion lie in different folders of the library.
    """
    motions = [take for take in takes if take[0].format != "c3d"] or takes
    first, *others = (take[0] for take in motions)
    for other in others:
        if other.folder != first.folder and other.format != "c3d":
            raise BadInput(
                f"The clip {name} differs between two folders: {first.path} and {other.path}.",
                "Rename or remove one of them, or name only one of the folders.",
            )
    named = {}
    for take in takes:
        place = take[0].place if "/" in take[0].place else f"./{take[0].place}"
        if take is motions[0] and not others:
            place = name
        elif place in named or sum(each[0].place == take[0].place for each in takes) > 1:
            place = f"{place}{take[0].path.name.removeprefix(name)}"
        named[place] = take
    return named


def _make_entry(name: str, take: Sequence[_File], performers: Collection[str]) -> LibraryEntry:
    """The entry of a take; `performers` are folders that tell takes of one name apart, and so the performers."""
    best, row, short = take[0], take[0].row, clip_name(take[0].path)
    folder = Path(best.place).parent.as_posix()
    if CMU_NAME.fullmatch(short) or not (folder in performers or best.format == "npz"):
        folder = "."
    return LibraryEntry(
        name=name,
        format=best.format,
        path=best.path,
        subject=row.get("subject") or (short.split("_", 1)[0] if folder == "." else folder),
        behaviour=row.get("behaviour") or "",
        frames=int(row["frames"]) if row.get("frames") else None,
        rate_hz=float(row["fps"]) if row.get("fps") else None,
        note=row.get("note") or "",
        copies=tuple(file.path for file in take[1:]),
        subject_known=bool(row.get("subject") or CMU_NAME.fullmatch(short)),
    )
