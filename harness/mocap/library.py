"""A folder of motion files, found by clip name wherever they lie below it, and loaded when asked for.

A clip's name is its subject and trial, such as "13_17"; copies of it in several formats share the name, and the one
that says most is loaded: AMC (with its ASF), then BVH, then AMASS npz. C3D files are listed; they hold markers, not
motion of a skeleton. What files do not say (behaviour, rate) comes from an index, `manifest.csv` at the top of the
folder with the columns path, subject, trial, behaviour, frames, fps and note, as far as it has them.
"""

import csv
import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from harness.core.motion import Clip
from harness.core.skeleton import unwrap_angles
from harness.errors import BadFile, BadInput, UnknownName
from harness.mocap.read.file_checks import check_size

INDEX_NAME = "manifest.csv"
FORMATS = ("amc", "bvh", "npz", "c3d")
"""By preference when a clip comes in several; the last holds markers and cannot be loaded as a clip."""

_INDEX_LIMIT_BYTES = 16 * 2**20
_CMU_NAME = re.compile(r"(\d+_\d+)(_poses|_stageii)?")


@dataclass(frozen=True)
class LibraryEntry:
    """One clip of a library: its preferred file, and what the index knows."""

    name: str
    format: str
    """`amc`, `bvh`, `npz` or `c3d`."""
    path: Path
    subject: str
    behaviour: str = ""
    frames: int | None = None
    rate_hz: float | None = None
    """From the index; files themselves may know better."""
    note: str = ""
    copies: tuple[Path, ...] = ()
    """The same clip in other formats or places."""

    def as_dict(self) -> dict[str, object]:
        """For JSON; paths as text."""
        return asdict(self) | {"path": str(self.path), "copies": [str(path) for path in self.copies]}

    def line(self) -> str:
        """For a list on a terminal."""
        frames = "?" if self.frames is None else str(self.frames)
        rate = "? Hz" if self.rate_hz is None else f"{self.rate_hz:g} Hz"
        words = f"{self.name:<10} {self.format:<4} {self.behaviour or '?':<14} {frames:>6} frames at {rate}"
        return f"{words}  {self.note}".rstrip()


class MotionLibrary:
    """Clips below `folder`; `rate_hz` is that of AMC files of which the index does not know the rate."""

    def __init__(self, folder: Path | str, *, rate_hz: float | None = None) -> None:
        self.folder = Path(folder)
        if not self.folder.is_dir():
            raise BadInput(f"{folder} is no folder.", "Name the folder of a motion library.")
        self._rate_hz = rate_hz
        self._entries = _find_entries(self.folder.resolve())

    def entries(self) -> tuple[LibraryEntry, ...]:
        """Every clip, sorted by name."""
        return tuple(self._entries.values())

    def names(self) -> tuple[str, ...]:
        """Clips that `load` can load."""
        return tuple(entry.name for entry in self.entries() if entry.format != "c3d")

    def entry(self, name: str) -> LibraryEntry:
        """What is known about a clip; UnknownName if there is none."""
        if name not in self._entries:
            raise UnknownName("clip", name, self._entries)
        return self._entries[name]

    def load(self, name: str) -> Clip:
        """The clip in world axes, angles unwrapped: on its own 30-bone skeleton (AMC), else on the 24 bones.

        UnknownName, BadFile; BadInput where the rate is not known or the file holds markers only.
        """
        entry = self.entry(name)
        clip = replace(
            self._read(entry),
            name=entry.name,
            subject=entry.subject,
            source="cmu" if _CMU_NAME.fullmatch(entry.name) else self.folder.name,
            behaviour=entry.behaviour,
        )
        notes = (entry.note, *clip.notes) if entry.note else clip.notes
        return replace(clip, notes=notes, angles_rad=unwrap_angles(clip.skeleton, clip.angles_rad))

    def _read(self, entry: LibraryEntry) -> Clip:
        if entry.format == "c3d":
            raise BadInput(f"{entry.name} is a C3D file, which holds markers.", "Give its AMC, BVH or npz.")
        if entry.format == "bvh":
            from harness.mocap.read.bvh import read_bvh_clip

            return read_bvh_clip(entry.path)
        if entry.format == "npz":
            from harness.mocap.read.amass import read_amass_clip as read_npz_clip

            return read_npz_clip(entry.path)
        from harness.mocap.read.acclaim import read_amc_clip

        rate_hz = entry.rate_hz or self._rate_hz
        if rate_hz is None:
            raise BadInput(
                f"The rate of {entry.name} is not known: AMC files record none, and no {INDEX_NAME} names it.",
                "Give the rate (--rate); CMU's clips have 120, some 60.",
            )
        return read_amc_clip(find_skeleton_file(entry.path, self.folder.resolve()), entry.path, rate_hz=rate_hz)


def find_skeleton_file(amc: Path, top: Path) -> Path:
    """The ASF of an AMC: called like its subject, beside it or above as far as `top`; else the only one beside it."""
    subject = amc.stem.split("_", 1)[0]
    for folder in amc.parents:
        for stem in (amc.stem, subject):
            for suffix in (".asf", ".ASF"):
                if (folder / f"{stem}{suffix}").is_file():
                    return folder / f"{stem}{suffix}"
        if folder == top:
            break
    beside = sorted(path for path in amc.parent.iterdir() if path.suffix.lower() == ".asf")
    if len(beside) == 1:
        return beside[0]
    found = "no skeleton" if not beside else f"{len(beside)} skeletons, none called {subject}.asf,"
    raise BadFile(amc, f"{found} beside it", f"{subject}.asf", "Put the ASF of this subject beside the AMC.")


def clip_name(path: Path) -> str:
    """The name of the clip in a file: its stem, without what AMASS adds to subject and trial."""
    match = _CMU_NAME.fullmatch(path.stem)
    return match[1] if match else path.stem


def _find_entries(top: Path) -> dict[str, LibraryEntry]:
    index = read_index(top / INDEX_NAME)
    files: dict[str, list[Path]] = {}
    for path in sorted(top.rglob("*")):
        if path.suffix.lower().lstrip(".") in FORMATS and path.is_file() and path.resolve().is_relative_to(top):
            files.setdefault(clip_name(path), []).append(path)
    return {name: _make_entry(name, files[name], top, index) for name in sorted(files)}


def _make_entry(name: str, files: list[Path], top: Path, index: Mapping[str, Mapping[str, str]]) -> LibraryEntry:
    best, *others = sorted(files, key=lambda path: (FORMATS.index(path.suffix.lower().lstrip(".")), path))
    row = index.get(best.relative_to(top).as_posix(), {})
    return LibraryEntry(
        name=name,
        format=best.suffix.lower().lstrip("."),
        path=best,
        subject=row.get("subject") or name.split("_", 1)[0],
        behaviour=row.get("behaviour") or "",
        frames=int(row["frames"]) if row.get("frames") else None,
        rate_hz=float(row["fps"]) if row.get("fps") else None,
        note=row.get("note") or "",
        copies=tuple(others),
    )


def read_index(path: Path) -> dict[str, dict[str, str]]:
    """Rows of a library's index by their path; {} if there is no such file, BadFile if it is none."""
    if not path.exists():
        return {}
    check_size(path, "an index of motion files", _INDEX_LIMIT_BYTES)
    with path.open(encoding="utf-8", newline="") as file:
        try:
            reader = csv.DictReader(file, strict=True)
            rows = [(reader.line_num, row) for row in reader]
        except (csv.Error, UnicodeDecodeError) as error:
            raise BadFile(path, str(error), "a table of comma-separated values", "Repair or remove it.") from error
    for line, row in rows:
        if not row.get("path"):
            raise BadFile(path, "a row without a path", "columns path, subject, behaviour, ...", "Repair it.", line)
        for column, kind in (("frames", int), ("fps", float)):
            _check_number(path, row.get(column) or "", column, kind, line)
    return {row["path"]: row for _, row in rows}


def _check_number(path: Path, word: str, column: str, kind: type[int] | type[float], line: int) -> None:
    try:
        good = not word or 0 < kind(word) < 1e9
    except ValueError:
        good = False
    if not good:
        raise BadFile(path, f"{column} {word[:40]!r}", "a number above 0", "Repair the index.", line)
