"""Changes sound files, reads them, and counts what became of each."""

import json
import random
import resource
import shutil
import sys
import time
import traceback
import warnings
from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

from harness.errors import HarnessError
from tests.fuzz.kinds import KINDS, Kind

LONGEST_S = 5.0
"""CPU time above which a file counts as a finding [s]."""
MOST_MEMORY_BYTES = 2**30
"""Growth of the process above which it does."""
LONGEST_MESSAGE = 2000
MOST_CHANGES = 3


@dataclass(frozen=True)
class Case:
    """One changed file and what became of it."""

    kind: str
    number: int
    outcome: str
    """`accepted`, `refused` or `finding`."""
    text: str
    """The refusal, or what was found."""


def run_cases(kind: Kind, folder: Path, seed: int, numbers: range) -> Iterator[Case]:
    """Change and read files of one kind; each case depends on the seed, the kind and its number alone."""
    kind.make(folder)
    sound = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    targets = sorted(path for pattern in kind.targets for path in folder.glob(pattern))
    kind.read(folder)
    for number in numbers:
        rng = random.Random(f"{seed} {kind.name} {number}")  # noqa: S311
        target = rng.choice(targets)
        data = changed_data(kind, sound[target], rng)
        _restore(folder, sound)
        target.write_bytes(data)
        if kind.mend is not None and rng.random() < 0.8:
            kind.mend(folder)
        yield Case(kind.name, number, *_read(kind, folder))
    _restore(folder, sound)


def changed_data(kind: Kind, data: bytes, rng: random.Random) -> bytes:
    for _ in range(rng.choice((1, 1, 1, 2, MOST_CHANGES))):
        try:
            data = rng.choice(kind.changes)(data, rng)
        except Exception:  # an earlier change left nothing that this one can parse
            return data
    return data


def _restore(folder: Path, sound: dict[Path, bytes]) -> None:
    for path in folder.rglob("*"):
        if path.is_file() and path not in sound:
            path.unlink()
    for path, data in sound.items():
        if not path.exists() or path.read_bytes() != data:
            path.write_bytes(data)


def _read(kind: Kind, folder: Path) -> tuple[str, str]:
    """What became of the changed folder, and the message."""
    start_s, start_bytes = time.process_time(), _peak_bytes()
    try:
        with warnings.catch_warnings(), redirect_stdout(StringIO()):
            warnings.simplefilter("error")
            text = str(kind.read(folder))
        outcome = "accepted"
        json.dumps(text).encode()
    except HarnessError as error:
        outcome, text = "refused", str(error)
        if fault := _message_fault(text):
            outcome, text = "finding", f"{fault}: {text[:500]!r}"
    except Exception as error:
        at = traceback.extract_tb(error.__traceback__)
        own = [frame for frame in at if "/harness/" in frame.filename] or list(at)
        place = f"{own[-1].filename.rpartition('/harness/')[2]}:{own[-1].name}"
        return "finding", f"{type(error).__name__} in {place}: {str(error)[:200]!r}"
    seconds, grown = time.process_time() - start_s, _peak_bytes() - start_bytes
    if seconds > LONGEST_S:
        return "finding", f"{seconds:.1f} s: {text[:200]!r}"
    if grown > MOST_MEMORY_BYTES:
        return "finding", f"{grown >> 20} MB: {text[:200]!r}"
    return outcome, text


def _message_fault(text: str) -> str:
    """What is wrong with a refusal; "" for one line of bounded length that can be printed."""
    if len(text) > LONGEST_MESSAGE:
        return f"{len(text)} characters"
    if not text.isprintable():
        return "a message that is not one printable line"
    return ""


def _peak_bytes() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def run_campaign(files: int, seed: int, folder: Path, names: tuple[str, ...] = tuple(KINDS)) -> Iterator[Case]:
    """Cases of all kinds, the same number of each."""
    for name in names:
        place = folder / name.replace(" ", "_")
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir(parents=True)
        yield from run_cases(KINDS[name], place, seed, range(files_of(name, files, names)))


def files_of(name: str, files: int, names: tuple[str, ...] = tuple(KINDS)) -> int:
    """How many of the files of all kinds are of this one; at least one."""
    return max(round(files * KINDS[name].share / sum(KINDS[each].share for each in names)), 1)
