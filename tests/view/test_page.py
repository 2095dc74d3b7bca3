"""The viewer's page in a browser, with its motion fetched in chunks, and the page that holds all of it."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from harness.errors import BadInput, UnknownName
from harness.report.kit.motion_player import PlayerClip
from harness.view import page
from harness.view.page import ViewedMotion, ViewerContent, write_page
from harness.view.server import ViewServer
from tests.view.fabricated import FRAMES, METHODS, make_clip

NAMES = ("walking", "boxing", "broken")


def viewed(loaded: list[int]) -> ViewedMotion:
    """Three clips, the third of which cannot be read; `loaded` gets the numbers of those that were asked for."""
    skeleton, _ = make_clip()

    def make(number: int) -> PlayerClip:
        loaded.append(number)
        if NAMES[number] == "broken":
            raise BadInput("The clip is damaged.", "Restore it.")
        return make_clip(NAMES[number])[1]

    return ViewedMotion("three <clips>", skeleton, NAMES, make, "a note", ("map", "ik"))


def test_clips_are_made_when_they_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "_CHUNK_FRAMES", 15)
    loaded: list[int] = []
    content = ViewerContent(viewed(loaded), "secret")
    first = content.find("/")
    assert first is not None
    assert b"three &lt;clips&gt;" in first.data
    assert b"secret" in first.data
    description = content.find("/motion.json")
    assert description is not None
    assert [clip["href"] for clip in json.loads(description.data)["clips"]] == [f"/clip/{n}.json" for n in range(3)]
    assert content.find("/clip/1/0") is None
    assert loaded == []
    clip = content.find("/clip/1.json")
    assert clip is not None
    described = json.loads(clip.data)
    assert [track["name"] for track in described["tracks"]] == ["truth", *METHODS]
    chunks = [*described["time"], *(chunk for track in described["tracks"] for chunk in track["joints"])]
    assert len(chunks) == len(set(chunks)) == 4 * -(-FRAMES // 15)
    assert all(content.find(chunk) is not None for chunk in chunks)
    assert content.find("/clip/1.json") is clip
    assert loaded == [1]
    assert content.find("/clip/3.json") is None


def test_a_clip_may_be_first() -> None:
    loaded: list[int] = []
    motion = viewed(loaded).beginning_with("boxing")
    assert motion.names == ("boxing", "walking", "broken")
    assert motion.clip(0).name == "boxing"
    assert motion.shown == ("map", "ik")
    with pytest.raises(UnknownName, match="no clip called 'golf'"):
        motion.beginning_with("golf")


@pytest.fixture
def opened(browser: Any) -> Iterator[tuple[Any, list[Mapping[str, Any]]]]:
    """The page in a browser, and the movies that it asked for."""
    asked: list[Mapping[str, Any]] = []

    def save(wanted: Mapping[str, Any]) -> Mapping[str, Any]:
        asked.append(wanted)
        if wanted["format"] == "gif":
            raise BadInput("No movie.", "Choose another.")
        return {"path": "/motion.json", "name": "a.mp4"}

    errors: list[str] = []
    content = ViewerContent(viewed([]), "token")
    with ViewServer(content.find, {"save": save}, token="token") as server:  # noqa: S106
        tab = browser.new_page(viewport={"width": 1000, "height": 800})
        tab.on("pageerror", lambda error: errors.append(str(error)))
        tab.on("request", lambda r: None if r.url.startswith(server.url) else errors.append(r.url))
        tab.goto(server.url)
        tab.wait_for_selector("#player[data-ready]", timeout=60_000)
        yield tab, asked
        tab.close()
    assert not errors


@pytest.mark.long
def test_the_page_plays_and_saves(opened: tuple[Any, list[Mapping[str, Any]]]) -> None:
    tab, asked = opened
    assert tab.evaluate("player.player.shown.map((track) => track.name)") == ["map", "ik"]
    tab.locator(".motion-player input[type=range]").fill("20")
    tab.fill("input[name=seconds]", "2")
    with tab.expect_download() as download:
        tab.click("button[name=save]")
    assert download.value.suggested_filename == "a.mp4"
    assert asked[0] == {
        "clip": 0, "methods": ["map", "ik"], "start_s": 0.5, "end_s": 2.5, "format": "mp4", "errors": False,
    }  # fmt: skip
    tab.select_option("select[name=format]", "gif")
    tab.click("button[name=save]")
    tab.wait_for_function("() => document.querySelector('.saved').textContent === 'No movie. Choose another.'")
    tab.select_option("select[name=clip]", "1")
    tab.wait_for_function("() => player.player.now.name === 'boxing'")
    tab.select_option("select[name=clip]", "2")
    tab.wait_for_function("() => document.querySelector('#player').innerText.includes('The clip is damaged.')")


@pytest.mark.long
def test_a_page_that_holds_everything_asks_for_nothing(browser: Any, tmp_path: Path) -> None:
    skeleton, clip = make_clip()
    motion = ViewedMotion("one", skeleton, [clip.name], lambda _: clip, shown=("map",))
    path = tmp_path / "page.html"
    path.write_text(write_page(motion), encoding="utf-8")
    errors: list[str] = []
    tab = browser.new_page()
    tab.on("request", lambda r: None if r.url == path.as_uri() else errors.append(r.url))
    tab.on("pageerror", lambda error: errors.append(str(error)))
    tab.goto(path.as_uri())
    tab.wait_for_selector("#player[data-ready]", timeout=60_000)
    assert tab.evaluate("player.player.shown.map((track) => track.name)") == ["map"]
    assert tab.locator("select[name=clip]").is_hidden()
    tab.close()
    assert not errors
