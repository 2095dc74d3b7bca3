"""`harness inspect FILE.mcf` as a user meets it."""

from pathlib import Path

import pytest

from harness.core.package_data import data_folder
from tests.command import Command
from tests.report.reading import text_of

CAVE = data_folder("models") / "constellations" / "cave.mcf"


@pytest.fixture(autouse=True)
def in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_it_prints_the_coverage_and_writes_a_page(tmp_path: Path, command: Command) -> None:
    (tmp_path / "room.mcf").write_bytes(CAVE.read_bytes())
    shown = command("inspect", "room.mcf")
    lines = shown.out.splitlines()
    assert lines[0].startswith("9 emitters: three or more are heard in 100 % of the cube")
    assert "emitters: 9 emitters on 1.83 x 1.22 x 0.00 m" in lines
    assert "turn: 0.113 s for a turn of the 9 nearest" in lines
    table = lines[lines.index("by place") + 1 :]
    assert [line.split()[0] for line in table[:5]] == ["height", "0", "0.3", "1", "1.7"]
    assert lines[-2:] == ["page: results/coverage/room.html", "pass"]
    assert shown.err == "next: harness inspect room.mcf --clip walking_p1_01\n"
    assert "9 emitters: three or more are heard" in text_of(tmp_path / "results" / "coverage" / "room.html")
    command("inspect", "room.mcf")  # the page is replaced


def test_a_shipped_constellation_is_found_by_its_name(command: Command) -> None:
    said = command("inspect", "hall.mcf", "--json").content
    assert (said["emitters"], said["clip"], said["stations"]) == (36, "", [])
    assert [row["place"] for row in said["rows"]] == ["0 to 2 m", "0.3 m", "1 m", "1.7 m"]
    assert said["rows"][2]["share"] == 1.0
    assert said["page"] == "results/coverage/hall.html"


def test_a_clip_adds_the_stations(tmp_path: Path, command: Command) -> None:
    words = ["inspect", "cave.mcf", "--clip", "boxing_p1_01", "--stations", "kim2012", "--out", "page.html"]
    said = command(*words, "--json").content
    assert said["clip"] == "boxing_p1_01"
    assert [row["station"] for row in said["stations"]] == [
        *("right_hand", "left_hand", "right_ankle", "left_ankle", "pelvis"),
    ]
    assert all(sum(row["shares"]) == pytest.approx(1.0) for row in said["stations"])
    assert all(row["shares"][3] > 0.8 and 1.0 < row["dilution"] < 4.0 for row in said["stations"])
    assert "it exists; expected a new file" in command(*words, code=2).err
    out = command(*words, "--force").out
    assert "clip: boxing_p1_01" in out
    assert "hears three for" in text_of(tmp_path / "page.html")
