"""Download of skeletons and motions of CMU's library, one file after another.

The site (http://mocap.cs.cmu.edu) keeps a subject's files in subjects/13/: 13.asf, 13_01.amc and so on. The trials are
read from its search page, or from the listing of that folder. A file is put in place only if it parses and, if it is
on the shipped list, has the listed SHA-256. So every file in place is complete and is not fetched again. CMU asks not
to crawl its site: name the subjects that are needed.
"""

import hashlib
import re
import tempfile
from collections.abc import Callable, Iterable
from http.client import HTTPException
from importlib.resources import files
from pathlib import Path
from urllib.error import HTTPError, URLError
from urllib.parse import urlsplit
from urllib.request import urlopen

from filelock import FileLock

from harness.core.csv_text import csv_line
from harness.core.files import atomic_path
from harness.errors import BadFile, BadInput
from harness.mocap.index import FETCHED, INDEX_NAME, read_index
from harness.mocap.read.amc import read_amc
from harness.mocap.read.asf import read_asf_file

CMU_URL = "http://mocap.cs.cmu.edu"
SHIPPED_RATE_HZ = 120.0
"""Frame rate of every clip on the shipped list [Hz]; CMU's other clips have 120 or 60, which no file records."""
TIMEOUT_S = 30.0

FetchProgress = Callable[[str, int, int], None]
"""Called with a file's name, the number of files done, and the number of all files."""


def fetch_cmu(
    subjects: Iterable[str],
    folder: Path | str,
    *,
    base_url: str = CMU_URL,
    progress: FetchProgress = lambda name, done, planned: None,
) -> list[Path]:
    """Download the skeleton and all motions of each subject to `folder`, and write the index; returns the files.

    Files that are in place already are kept. Raises BadInput for a subject or a site that cannot be reached, and
    BadFile for a file that does not parse or has another SHA-256 than listed; files finished before that stay.
    """
    _check_site(base_url)
    top = Path(folder)
    names: list[str] = []
    for subject in subjects:
        if not re.fullmatch(r"[0-9]{1,3}", subject):
            raise BadInput(f"{subject!r} is not a subject of CMU.", "Subjects are numbers, such as 02 or 13.")
        names += _list_subject_files(subject.zfill(2), base_url)
    if not names:
        raise BadInput("No subject is named.", "For example: --subjects 13,14.")
    fetched = []
    for done, name in enumerate(names):
        progress(name, done, len(names))
        fetched.append(_fetch_file(name, top, base_url))
    progress("", len(names), len(names))
    _write_index(top, names)
    return fetched


def shipped_sha256() -> dict[str, str]:
    """SHA-256 of files of known origin by name ("13/13_17.amc"), computed with LF line ends.

    Copies of CMU's files differ in their line ends only, so line ends are converted first.
    """
    lines = files("harness.mocap").joinpath("cmu_sha256.txt").read_text(encoding="ascii").splitlines()
    return {name: digest for digest, name in (line.split() for line in lines if not line.startswith("#"))}


def sha256_of(path: Path) -> str:
    """SHA-256 of a text file, with its line ends converted to LF."""
    return hashlib.sha256(path.read_bytes().replace(b"\r\n", b"\n")).hexdigest()


def _check_site(base_url: str) -> None:
    """Raise BadInput unless the address is one of the web."""
    parts = urlsplit(base_url)
    if parts.scheme not in ("http", "https") or not parts.netloc:
        raise BadInput(f"{base_url!r} is not the address of a site.", "It starts with http:// or https://.")


def _list_subject_files(subject: str, base_url: str) -> list[str]:
    """Names of a subject's files, the skeleton first, from the search page of the site or the listing of its folder."""
    pages = (f"{base_url}/search.php?subjectnumber={subject}", f"{base_url}/subjects/{subject}/")
    with tempfile.TemporaryDirectory() as folder:
        for page in pages:
            try:
                text = _download(page, Path(folder) / "page").read_text(encoding="latin-1")
            except _NotFound:
                continue
            trials = sorted(set(re.findall(rf"\b{subject}_[0-9]{{2,3}}\.amc\b", text)))
            if trials:
                return [f"{subject}/{name}" for name in (f"{subject}.asf", *trials)]
    raise BadInput(f"{urlsplit(base_url).netloc} lists no motions of subject {subject}.", f"The page was {pages[0]}.")


class _NotFound(Exception):
    """The site answered, but has no such page or file."""


def _download(url: str, path: Path) -> Path:
    """Download a page or file to `path`; _NotFound if the site has none, BadInput if the site cannot deliver it."""
    try:
        with urlopen(url, timeout=TIMEOUT_S) as response:  # noqa: S310 - `_check_site` allows http and https only
            content = response.read()
    except HTTPError as error:
        error.close()
        if error.code < 500:
            raise _NotFound(url) from error
        raise _unreachable(url, f"HTTP {error.code}") from error
    except (OSError, HTTPException, ValueError) as error:
        cause = error.reason if isinstance(error, URLError) and isinstance(error.reason, Exception) else error
        raise _unreachable(url, type(cause).__name__) from error
    path.write_bytes(content)
    return path


def _unreachable(url: str, reason: str) -> BadInput:
    return BadInput(
        f"{urlsplit(url).netloc} cannot be reached ({reason}).", "Check the network, or name a mirror (--url)."
    )


def _fetch_file(name: str, top: Path, base_url: str) -> Path:
    """Download and check one file, then move it into place; a file in place is kept if its SHA-256 is as listed."""
    path = top / name
    listed = shipped_sha256().get(name)
    if path.is_file() and listed in (None, sha256_of(path)):
        return path
    path.parent.mkdir(parents=True, exist_ok=True)
    url = f"{base_url}/subjects/{name}"
    with atomic_path(path) as new:
        try:
            _download(url, new)
        except _NotFound:
            raise BadInput(f"There is no {url}.", "Check that the site has the layout of CMU's.") from None
        _check_file(new, url, listed, path)
    return path


def _check_file(new: Path, url: str, listed: str | None, path: Path) -> None:
    """Raise BadFile with the address unless a file that shall lie at `path` parses and has the listed SHA-256."""
    try:
        if path.suffix == ".asf":
            read_asf_file(new)
        else:
            skeleton, _ = read_asf_file(path.with_name(f"{path.stem.split('_')[0]}.asf"))
            read_amc(new, skeleton, rate_hz=SHIPPED_RATE_HZ)
    except BadFile as error:
        raise BadFile(url, error.found, error.expected, "It was not kept; try again.", error.line) from error
    sha256 = sha256_of(new)
    if listed not in (None, sha256):
        advice = "It was not kept; try again, or use another mirror."
        raise BadFile(url, f"a file with SHA-256 {sha256[:12]}...", f"{listed[:12]}... as shipped", advice)


def _write_index(top: Path, names: list[str]) -> None:
    """Add the motions to the folder's index, with their rate where it is known.

    The index is replaced in one step. Another fetch into this folder waits, so that no rows are lost.
    """
    listed, lock = shipped_sha256(), top / f"{FETCHED}{INDEX_NAME}.lock"
    with FileLock(lock):
        rows = read_index(top / INDEX_NAME)
        for name in names:
            if name.endswith(".amc"):
                subject, trial = Path(name).stem.split("_")
                fps = f"{SHIPPED_RATE_HZ:g}" if name in listed else ""
                rows.setdefault(name, {"path": name, "subject": subject, "trial": trial, "fps": fps})
        columns = list(dict.fromkeys(column for row in rows.values() for column in row))
        with atomic_path(top / INDEX_NAME) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
            file.write(csv_line(columns))
            file.writelines(csv_line([row.get(name) for name in columns]) for row in rows.values())
        lock.unlink(missing_ok=True)  # while it is held: a lock on a removed file does not count
