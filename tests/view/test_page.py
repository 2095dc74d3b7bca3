"""The viewer's page in a browser, with its motion fetched in chunks, and the page that holds all of it."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from harness.errors import BadInput, UnknownName
from harness.report.kit import PlayerClip
from harness.view import page
from harness.view.page import ViewedMotion, ViewerContent, write_page
from harness.view.server import ViewServer


def watched(motion: ViewedMotion, loaded: list[int]) -> ViewedMotion:
    """The clips and one that cannot be read; `loaded` gets the numbers of those that were asked for."""

    def make(number: int) -> PlayerClip:
        loaded.append(number)
        if number == len(motion.names):
            raise BadInput("The clip is damaged.", "Restore it.")
        return motion.clip(number)

    return ViewedMotion("three <clips>", motion.skeleton, (*motion.names, "broken"), make, "a note", ("map", "ik"))


def test_clips_are_made_when_they_are_asked_for(motion: ViewedMotion, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "_CHUNK_FRAMES", 15)
    loaded: list[int] = []
    content = ViewerContent(watched(motion, loaded), "secret")
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
    assert [track["name"] for track in described["tracks"]] == ["truth", "map", "ik", "far"]
    chunks = [*described["time"], *(chunk for track in described["tracks"] for chunk in track["joints"])]
    assert len(chunks) == len(set(chunks)) == 5 * -(-len(motion.clip(1).time_s) // 15)
    assert all(content.find(chunk) is not None for chunk in chunks)
    assert content.find("/clip/1.json") is clip
    assert loaded == [1]
    assert content.find("/clip/3.json") is None


def test_a_clip_may_be_first(motion: ViewedMotion) -> None:
    boxing = watched(motion, []).beginning_with("boxing_p1_01")
    assert boxing.names == ("boxing_p1_01", "walking_p1_01", "broken")
    assert boxing.clip(0).name == "boxing_p1_01"
    assert boxing.shown == ("map", "ik")
    with pytest.raises(UnknownName, match="no clip called 'golf'"):
        boxing.beginning_with("golf")


@pytest.fixture
def opened(browser: Any, motion: ViewedMotion) -> Iterator[tuple[Any, list[Mapping[str, Any]]]]:
    """The page in a browser, and the movies that it asked for."""
    asked: list[Mapping[str, Any]] = []

    def save(wanted: Mapping[str, Any]) -> Mapping[str, Any]:
        asked.append(wanted)
        if wanted["format"] == "gif":
            raise BadInput("No movie.", "Choose another.")
        return {"path": "/motion.json", "name": "a.mp4"}

    errors: list[str] = []
    content = ViewerContent(watched(motion, []), "token")
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
def test_the_page_plays_and_saves(opened: tuple[Any, list[Mapping[str, Any]]], motion: ViewedMotion) -> None:
    tab, asked = opened
    start_s = float(motion.clip(0).time_s[20])
    assert tab.evaluate("player.player.shown.map((track) => track.name)") == ["map", "ik"]
    tab.locator(".motion-player input[type=range]").fill("20")
    tab.fill("input[name=seconds]", "2")
    with tab.expect_download() as download:
        tab.click("button[name=save]")
    assert download.value.suggested_filename == "a.mp4"
    assert [asked[0][key] for key in ("start_s", "end_s")] == pytest.approx([start_s, start_s + 2.0], abs=1e-3)
    others = {key: value for key, value in asked[0].items() if key not in ("start_s", "end_s")}
    assert others == {"clip": 0, "methods": ["map", "ik"], "format": "mp4", "errors": False}
    tab.select_option("select[name=format]", "gif")
    tab.click("button[name=save]")
    tab.wait_for_function("() => document.querySelector('.saved').textContent === 'No movie. Choose another.'")
    tab.select_option("select[name=clip]", "1")
    tab.wait_for_function("() => player.player.now.name === 'boxing_p1_01'")
    tab.select_option("select[name=clip]", "2")
    tab.wait_for_function("() => document.querySelector('#player').innerText.includes('The clip is damaged.')")


@pytest.mark.long
def test_a_page_that_holds_everything_asks_for_nothing(browser: Any, motion: ViewedMotion, tmp_path: Path) -> None:
    one = ViewedMotion("one", motion.skeleton, motion.names[:1], motion.clip, shown=("ik",))
    path = tmp_path / "page.html"
    path.write_text(write_page(one), encoding="utf-8")
    errors: list[str] = []
    tab = browser.new_page()
    tab.on("request", lambda r: None if r.url == path.as_uri() else errors.append(r.url))
    tab.on("pageerror", lambda error: errors.append(str(error)))
    tab.goto(path.as_uri())
    tab.wait_for_selector("#player[data-ready]", timeout=60_000)
    assert tab.evaluate("player.player.shown.map((track) => track.name)") == ["ik"]
    assert tab.locator("select[name=clip]").is_hidden()
    tab.close()
    assert not errors
