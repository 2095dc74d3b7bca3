"""Download from a local server: complete files are kept, others are removed, and errors are one clear line."""

import csv
import hashlib
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from harness.errors import BadFile, BadInput
from harness.mocap import fetch
from harness.mocap.fetch import fetch_cmu, sha256_of, shipped_sha256
from harness.mocap.index import read_index
from harness.mocap.library import MotionLibrary
from tests.mocap.sample_files import clip, write_clip


class Site:
    """A small site with CMU's layout: subject 91 with two motions."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.asked: list[str] = []
        self.answer = b""
        """Bytes that are sent instead of the page or file, unless empty."""
        site = self

        class Handler(SimpleHTTPRequestHandler):
            def do_GET(self) -> None:
                site.asked.append(self.path)
                if site.answer:
                    self.wfile.write(site.answer)
                else:
                    super().do_GET()

            def log_message(self, format: str, *args: object) -> None:
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Handler, directory=str(folder)))
        self.url = f"http://127.0.0.1:{self.server.server_address[1]}"


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    folder = tmp_path / "site"
    for name in ("91_01", "91_02"):
        write_clip(folder / "subjects", clip(name=name))
    serving = Site(folder)
    thread = threading.Thread(target=serving.server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    yield serving
    serving.server.shutdown()
    thread.join()
    serving.server.server_close()


def _names(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file())


def test_a_subject_is_fetched_and_can_be_loaded(site: Site, tmp_path: Path) -> None:
    out = tmp_path / "out"
    told: list[tuple[str, int, int]] = []
    files = fetch_cmu(["91"], out, base_url=site.url, progress=lambda *step: told.append(step))
    assert [file.name for file in files] == ["91.asf", "91_01.amc", "91_02.amc"]
    assert _names(out) == ["91/91.asf", "91/91_01.amc", "91/91_02.amc", "manifest.csv"]
    assert told == [("91/91.asf", 0, 3), ("91/91_01.amc", 1, 3), ("91/91_02.amc", 2, 3), ("", 3, 3)]
    assert len(MotionLibrary(out, rate_hz=120.0).load("91_02")) == 24


KILLED_FETCH = """
import sys
from harness.mocap import fetch
def stay(url, path):
    path.write_bytes(b"half")
    print(path, flush=True)
    sys.stdin.read()
fetch._list_subject_files = lambda subject, base_url: [f"{subject}/{subject}.asf"]
fetch._download = stay
fetch.fetch_cmu(["92"], sys.argv[1], base_url="http://localhost")
"""


def test_a_fetch_removes_what_dead_fetches_left_and_nothing_of_living_ones(site: Site, tmp_path: Path) -> None:
    write_clip(site.folder / "subjects", replace(clip(name="92_01"), subject="92"))
    out = tmp_path / "out"
    old = out / "90" / ".fetch-ab12cd"  # as an earlier version left it
    old.mkdir(parents=True)
    (old / "90_01.amc").write_text("half")
    command = [sys.executable, "-c", KILLED_FETCH, str(out)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        half = Path(process.stdout.readline().strip())
        assert half.read_bytes() == b"half"
        fetch_cmu(["91"], out, base_url=site.url)
        fetch_cmu(["92"], out, base_url=site.url)
        assert half.is_file()
        assert MotionLibrary(out).names() == ("91_01", "91_02", "92_01")
        process.kill()
    assert half.is_file()
    (out / "92" / "92.asf").unlink()
    fetch_cmu(["92"], out, base_url=site.url)
    assert not half.exists()


def test_what_is_there_is_not_fetched_again(site: Site, tmp_path: Path) -> None:
    out = tmp_path / "out"
    first = fetch_cmu(["91"], out, base_url=site.url)
    stamps = [file.stat().st_mtime_ns for file in first]
    site.asked.clear()
    (out / "91" / "91_02.amc").unlink()
    second = fetch_cmu(["91"], out, base_url=site.url)
    assert [path for path in site.asked if path.endswith((".asf", ".amc"))] == ["/subjects/91/91_02.amc"]
    assert [file.stat().st_mtime_ns for file in second[:2]] == stamps[:2]


def test_the_search_page_names_the_trials_first(site: Site, tmp_path: Path) -> None:
    (site.folder / "search.php").write_text('<a href="subjects/91/91_02.amc">amc</a> 91_02.amc and 92_01.amc')
    files = fetch_cmu(["91"], tmp_path / "out", base_url=site.url)
    assert [file.name for file in files] == ["91.asf", "91_02.amc"]


@pytest.mark.parametrize("spoil", [b"", b"<html>busy, come back later</html>", b"cut"])
def test_bytes_that_do_not_parse_never_stay(site: Site, tmp_path: Path, spoil: bytes) -> None:
    out, bad = tmp_path / "out", site.folder / "subjects" / "91" / "91_02.amc"
    bad.write_bytes(bad.read_bytes()[:-500] if spoil == b"cut" else spoil)
    with pytest.raises(BadFile) as error:
        fetch_cmu(["91"], out, base_url=site.url)
    assert error.value.path == f"{site.url}/subjects/91/91_02.amc"
    assert "It was not kept" in error.value.advice
    assert "\n" not in str(error.value)
    assert _names(out) == ["91/91.asf", "91/91_01.amc"]


def test_bytes_unlike_the_shipped_list_never_stay(site: Site, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    right = sha256_of(site.folder / "subjects" / "91" / "91_01.amc")
    monkeypatch.setattr(fetch, "shipped_sha256", lambda: {"91/91_01.amc": right, "91/91_02.amc": "0" * 64})
    with pytest.raises(BadFile, match=r"SHA-256 .* expected 000000000000\.\.\. as shipped"):
        fetch_cmu(["91"], out, base_url=site.url)
    assert _names(out) == ["91/91.asf", "91/91_01.amc"]


def test_a_file_that_was_changed_is_fetched_again_if_it_is_listed(
    site: Site, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, source = tmp_path / "out", site.folder / "subjects" / "91" / "91_01.amc"
    monkeypatch.setattr(fetch, "shipped_sha256", lambda: {"91/91_01.amc": sha256_of(source)})
    fetch_cmu(["91"], out, base_url=site.url)
    (out / "91" / "91_01.amc").write_text("changed")
    fetch_cmu(["91"], out, base_url=site.url)
    assert (out / "91" / "91_01.amc").read_bytes() == source.read_bytes()
    assert MotionLibrary(out).load("91_01").rate_hz == 120.0  # the rate of what is listed is known
    with pytest.raises(BadInput, match="--rate"):
        MotionLibrary(out).load("91_02")


def test_line_ends_do_not_count(tmp_path: Path) -> None:
    unix, dos = tmp_path / "a", tmp_path / "b"
    unix.write_bytes(b"1\n2\n")
    dos.write_bytes(b"1\r\n2\r\n")
    assert sha256_of(unix) == sha256_of(dos) == hashlib.sha256(b"1\n2\n").hexdigest()


def test_an_index_that_is_there_is_added_to(site: Site, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "manifest.csv").write_text("path,behaviour,fps\n91/91_01.amc,walking,60\nother.bvh,golf,\n")
    fetch_cmu(["91"], out, base_url=site.url)
    with (out / "manifest.csv").open(newline="") as file:
        rows = {row["path"]: row for row in csv.DictReader(file)}
    assert list(rows) == ["91/91_01.amc", "other.bvh", "91/91_02.amc"]
    assert (rows["91/91_01.amc"]["behaviour"], rows["91/91_01.amc"]["fps"]) == ("walking", "60")


def test_two_fetches_at_once_add_to_one_index(site: Site, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_clip(site.folder / "subjects", replace(clip(name="92_01"), subject="92"))
    others: list[threading.Thread] = []

    def read_while_another_fetches(path: Path) -> dict[str, dict[str, str]]:
        rows = read_index(path)
        if not others:
            others.append(threading.Thread(target=fetch_cmu, args=(["92"], tmp_path), kwargs={"base_url": site.url}))
            others[0].start()
            others[0].join(1.0)
        return rows

    monkeypatch.setattr(fetch, "read_index", read_while_another_fetches)
    fetch_cmu(["91"], tmp_path, base_url=site.url)
    others[0].join()
    assert set(read_index(tmp_path / "manifest.csv")) == {"91/91_01.amc", "91/91_02.amc", "92/92_01.amc"}
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize("subject", ["../13", "13;14", "", "all", "1234"])
def test_a_subject_is_a_number(tmp_path: Path, subject: str) -> None:
    with pytest.raises(BadInput, match="is not a subject of CMU"):
        fetch_cmu([subject], tmp_path / "out", base_url="http://127.0.0.1:1")
    assert not (tmp_path / "out").exists()


def test_some_subject_must_be_named(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="No subject is named"):
        fetch_cmu([], tmp_path / "out")


def test_an_unknown_subject_is_one_clear_line(site: Site, tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="lists no motions of subject 07"):
        fetch_cmu(["7"], tmp_path / "out", base_url=site.url)


def test_a_listed_file_that_is_gone_is_one_clear_line(site: Site, tmp_path: Path) -> None:
    (site.folder / "search.php").write_text("91_01.amc 91_07.amc")
    with pytest.raises(BadInput, match=r"There is no http.*91_07\.amc"):
        fetch_cmu(["91"], tmp_path / "out", base_url=site.url)


def test_no_network_is_one_clear_line(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match="cannot be reached") as error:
        fetch_cmu(["13"], tmp_path / "out", base_url="http://127.0.0.1:1")
    assert "\n" not in str(error.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("url", ["file:///etc", "ftp://127.0.0.1", "mocap.cs.cmu.edu", "http://"])
def test_only_a_site_of_the_web_is_asked(tmp_path: Path, url: str) -> None:
    with pytest.raises(BadInput, match="is not the address of a site"):
        fetch_cmu(["13"], tmp_path / "out", base_url=url)


@pytest.mark.parametrize(
    ("url", "reason"), [("http://127.0.0.1:no", "InvalidURL"), ("http://127.0.0.1:1/ä", "Unicode")]
)
def test_an_address_that_cannot_be_asked_is_one_clear_line(tmp_path: Path, url: str, reason: str) -> None:
    with pytest.raises(BadInput, match=f"cannot be reached .{reason}"):
        fetch_cmu(["13"], tmp_path / "out", base_url=url)


def test_a_site_with_a_fault_is_not_a_file_that_is_gone(site: Site, tmp_path: Path) -> None:
    site.answer = b"HTTP/1.0 503 Busy\r\n\r\n"
    with pytest.raises(BadInput, match=r"cannot be reached .HTTP 503"):
        fetch_cmu(["91"], tmp_path / "out", base_url=site.url)


def test_a_page_that_breaks_off_is_not_kept(site: Site, tmp_path: Path) -> None:
    site.answer = b"HTTP/1.0 200 OK\r\nContent-Length: 99\r\n\r\n91_01.amc"
    with pytest.raises(BadInput, match=r"cannot be reached .IncompleteRead"):
        fetch_cmu(["91"], tmp_path / "out", base_url=site.url)


def test_the_shipped_list_is_that_of_the_library(mocap: Path) -> None:
    """Every file of the library on the list has the listed digest, and the index has the digest of its exact bytes."""
    listed, found = shipped_sha256(), 0
    with (mocap / "manifest.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            path = mocap / row["path"]
            name = f"{path.stem.split('_')[0]}/{path.name}"
            if name in listed:
                found += 1
                assert sha256_of(path) == listed[name]
                assert hashlib.sha256(path.read_bytes()).hexdigest() == row["sha256"]
    assert found >= len(listed) == 180


def test_real_files_pass_as_cmus(mocap: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two real files pass the checks of a download."""
    for name in ("13.asf", "13_30.amc"):
        (tmp_path / name).write_bytes((mocap / "cmu" / "13" / name).read_bytes())
        fetch._check_file(tmp_path / name, name, shipped_sha256()[f"13/{name}"], tmp_path / name)
    file = tmp_path / "13_30.amc"
    with pytest.raises(BadFile, match="SHA-256"):
        fetch._check_file(file, "13_30.amc", shipped_sha256()["13/13_17.amc"], file)
