"""`harness inspect FILE.mcf` as a user meets it."""

import json
from pathlib import Path

import pytest

from harness.cli import main
from harness.core.package_data import data_folder
from tests.report.reading import text_of

CAVE = data_folder("models") / "constellations" / "cave.mcf"


@pytest.fixture(autouse=True)
def in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_it_prints_the_coverage_and_writes_a_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "room.mcf").write_bytes(CAVE.read_bytes())
    assert main(["inspect", "room.mcf"]) == 0
    shown = capsys.readouterr()
    lines = shown.out.splitlines()
    assert lines[0].startswith("9 emitters: three or more are heard in 100 % of the cube")
    assert "emitters: 9 emitters on 1.83 x 1.22 x 0.00 m" in lines
    assert "turn: 0.113 s for a turn of all emitters" in lines
    table = lines[lines.index("by place") + 1 :]
    assert [line.split()[0] for line in table[:5]] == ["height", "0", "0.3", "1", "1.7"]
    assert lines[-2:] == ["page: results/coverage/room.html", "pass"]
    assert shown.err == "next: harness inspect room.mcf --clip walking_p1_01\n"
    assert "9 emitters: three or more are heard" in text_of(tmp_path / "results" / "coverage" / "room.html")
    assert main(["inspect", "room.mcf"]) == 0, "the page is replaced"


def test_a_shipped_constellation_is_found_by_its_name(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inspect", "hall.mcf", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["emitters"], said["clip"], said["stations"]) == (36, "", [])
    assert [row["place"] for row in said["rows"]] == ["0 to 2 m", "0.3 m", "1 m", "1.7 m"]
    assert said["rows"][2]["share"] == 1.0
    assert said["page"] == "results/coverage/hall.html"


def test_a_clip_adds_the_stations(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["inspect", "cave.mcf", "--clip", "boxing_p1_01", "--stations", "kim2012", "--out", "page.html"]
    assert main([*words, "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["clip"] == "boxing_p1_01"
    assert [row["station"] for row in said["stations"]] == [
        *("right_hand", "left_hand", "right_ankle", "left_ankle", "pelvis"),
    ]
    assert all(sum(row["shares"]) == pytest.approx(1.0) for row in said["stations"])
    assert all(row["shares"][3] > 0.8 and 1.0 < row["dilution"] < 4.0 for row in said["stations"])
    assert main(words) == 2
    assert "page.html exists." in capsys.readouterr().err
    assert main([*words, "--force"]) == 0
    out = capsys.readouterr().out
    assert "clip: boxing_p1_01" in out
    assert "hears three for" in text_of(tmp_path / "page.html")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("hal.mcf", "no constellation called 'hal'. Did you mean 'hall'?"),
        ("no/hall.mcf", "no such file"),
        ("two.mcf", "two.mcf: 2 emitters; expected 3 or more"),
        ("bad.mcf", "bad.mcf, line 2: the line"),
        ("hall.mcf --unit 0.01", "An MCF file is in metres."),
        ("hall.mcf --stations kim2012", "--stations without --clip."),
        ("hall.mcf --rate 120", "--rate without --clip."),
        ("hall.mcf --clip walking_p1_1", "walking_p1_1"),
        ("hall.mcf --clip no.bvh", "no.bvh"),
        ("hall.mcf --clip walking_p1_01 --stations kim2011", "Did you mean 'kim2012'?"),
        ("a.bvh --clip walking_p1_01", "It is for an MCF file of emitters."),
        ("a.bvh --out x.html", "It is for an MCF file of emitters."),
        ("a.bvh --force", "It is for an MCF file of emitters."),
    ],
)
def test_what_is_refused_says_why(
    words: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.delenv("HARNESS_MOCAP", raising=False)
    lines = CAVE.read_bytes().splitlines(keepends=True)
    (tmp_path / "two.mcf").write_bytes(b"".join(lines[1:3]))
    (tmp_path / "bad.mcf").write_bytes(lines[0] + b"\x00\x01" + b"".join(lines[1:]))
    assert main(["inspect", *words.split()]) == 2
    shown = capsys.readouterr()
    assert shown.out == "refused\n"
    assert said in shown.err
    assert len(shown.err.splitlines()) == 1
    assert not (tmp_path / "results").exists()
