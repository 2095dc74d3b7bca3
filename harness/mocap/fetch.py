"""Downloading skeletons and motions of CMU's library, through pooch, one file after another.

The site (http://mocap.cs.cmu.edu) keeps a subject's files in subjects/13/: 13.asf, 13_01.amc and so on; which trials
there are is read from its search page, or from the folder's own listing. A file is put in place only when it parses
and, if it is on the shipped list, has the listed SHA-256, so what is there is whole and is not fetched again. CMU asks
not to crawl its site: name the subjects that are needed.
"""

import csv
import hashlib
import re
import tempfile
from collections.abc import Callable, Iterable
from importlib.resources import files
from pathlib import Path
from urllib.parse import urlsplit

from harness.core.files import atomic_path, move_into_place
from harness.core.motion import Clip
from harness.errors import BadFile, BadInput
from harness.mocap.index import INDEX_NAME, read_index
from harness.mocap.read.acclaim import AsfFile, read_amc, read_asf_file

CMU_URL = "http://mocap.cs.cmu.edu"
SHIPPED_RATE_HZ = 120.0
"""Of every clip on the shipped list; CMU's other clips have 120 or 60, which no file tells."""
TIMEOUT_S = 30.0

FetchProgress = Callable[[str, int, int], None]
"""Called with a file's name, how many are done, and how many there will be."""


def fetch_cmu(
    subjects: Iterable[str],
    folder: Path | str,
    *,
    base_url: str = CMU_URL,
    progress: FetchProgress = lambda name, done, planned: None,
) -> list[Path]:
    """The skeleton and all motions of each subject below `folder`, with an index; those in place are kept.

    Raises BadInput for a subject or site that cannot be reached, BadFile for bytes that cannot be trusted; files that
    were finished before stay.
    """
    top = Path(folder)
    wanted: list[str] = []
    for subject in subjects:
        if not re.fullmatch(r"[0-9]{1,3}", subject):
            raise BadInput(f"{subject!r} is no subject of CMU.", "Subjects are numbers, such as 02 or 13.")
        wanted += _list_subject_files(subject.zfill(2), base_url)
    if not wanted:
        raise BadInput("No subjects are named.", "For example: --subjects 13,14.")
    fetched = []
    for done, name in enumerate(wanted):
        progress(name, done, len(wanted))
        fetched.append(_fetch_file(name, top, base_url))
    progress("", len(wanted), len(wanted))
    _write_index(top, wanted)
    return fetched


def shipped_sha256() -> dict[str, str]:
    """SHA-256 by name ("13/13_17.amc") of files whose origin is known, taken with LF line ends.

    Copies of CMU's files differ in their line ends, so these are evened out first.
    """
    lines = files("harness.mocap").joinpath("cmu_sha256.txt").read_text(encoding="ascii").splitlines()
    return {name: digest for digest, name in (line.split() for line in lines if not line.startswith("#"))}


def sha256_of(path: Path) -> str:
    """SHA-256 of a text file with LF line ends."""
    return hashlib.sha256(path.read_bytes().replace(b"\r\n", b"\n")).hexdigest()


def _list_subject_files(subject: str, base_url: str) -> list[str]:
    """A subject's files by the site's search page, or by the listing of its folder; the skeleton first."""
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
    raise BadInput(f"{urlsplit(base_url).netloc} lists no motions of subject {subject}.", f"Looked at {pages[0]}.")


class _NotFound(Exception):
    """The site answered, but has no such page or file."""


def _download(url: str, path: Path) -> Path:
    """One page or file, to `path`; _NotThere if the site has none, BadInput if there is no such site."""
    import pooch

    pooch.get_logger().setLevel("WARNING")
    try:
        pooch.retrieve(url, None, fname=path.name, path=path.parent, downloader=pooch.HTTPDownloader(timeout=TIMEOUT_S))
    except OSError as error:
        if getattr(error, "response", None) is not None:
            raise _NotFound(url) from error
        where = urlsplit(url).netloc
        raise BadInput(
            f"{where} cannot be reached ({type(error).__name__}).", "Check the network, or name a mirror (--url)."
        ) from error
    return path


def _fetch_file(name: str, top: Path, base_url: str) -> Path:
    """One file, checked, then put in place in one step; a file that is in place already is kept if it is as listed."""
    place = top / name
    listed = shipped_sha256().get(name)
    if place.is_file() and listed in (None, sha256_of(place)):
        return place
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInput(
            f"{place.parent} cannot be made ({error.strerror}).", "Name another folder with --out."
        ) from error
    with tempfile.TemporaryDirectory(dir=place.parent, prefix=".fetch-") as folder:
        url = f"{base_url}/subjects/{name}"
        try:
            new = _download(url, Path(folder) / place.name)
        except _NotFound:
            raise BadInput(f"There is no {url}.", "Is the site laid out like CMU's?") from None
        _check_file(new, url, listed, place.parent)
        move_into_place(new, place)
    return place


def _check_file(new: Path, url: str, listed: str | None, beside: Path) -> None:
    """BadFile, naming the address, unless the file parses and is as listed."""
    try:
        _parse_file(new, beside)
    except BadFile as error:
        raise BadFile(url, error.found, error.expected, "Nothing was kept of it; try again.", error.line) from error
    found = sha256_of(new)
    if listed not in (None, found):
        advice = "Nothing was kept of it; try again, or another mirror."
        raise BadFile(url, f"a file with SHA-256 {found[:12]}...", f"{listed[:12]}... as shipped", advice)


def _parse_file(path: Path, beside: Path) -> AsfFile | Clip:
    if path.suffix == ".asf":
        return read_asf_file(path)
    asf = read_asf_file(beside / f"{path.stem.split('_')[0]}.asf")
    return read_amc(path, asf.skeleton, rate_hz=SHIPPED_RATE_HZ)


def _write_index(top: Path, names: list[str]) -> None:
    """Add the motions to the folder's index, with the rate of those whose rate is known; replaced in one step."""
    rows = read_index(top / INDEX_NAME)
    known = shipped_sha256()
    for name in names:
        if name.endswith(".amc"):
            subject, trial = Path(name).stem.split("_")
            fps = f"{SHIPPED_RATE_HZ:g}" if name in known else ""
            rows.setdefault(name, {"path": name, "subject": subject, "trial": trial, "fps": fps})
    columns = list(dict.fromkeys(column for row in rows.values() for column in row))
    with atomic_path(top / INDEX_NAME) as temporary, open(temporary, "w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, columns)
        table.writeheader()
        table.writerows(rows.values())
