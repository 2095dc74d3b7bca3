"""The live page in a browser: it draws frames, lists stations, reports silence, and starts a recording."""

from collections.abc import Mapping
from contextlib import closing
from typing import Any

import numpy as np
import pytest

from harness.body import build_body, pose_from_qpos, tpose
from harness.errors import BadInput
from harness.view.live_page import LiveContent
from harness.view.server import ViewServer

pytestmark = pytest.mark.long
SKELETON = build_body().skeleton


def frame(number: int) -> dict[str, Any]:
    qpos = tpose(SKELETON)
    pose = pose_from_qpos(SKELETON, qpos[None])
    joints_mm = np.rint(1e3 * np.concatenate([qpos[None, :3], pose.end_m[0]])).astype(int).ravel().tolist()
    stations = [
        {"quality": 1.0, "state": 0, "pose": [0, 0, 1500, 1000, 0, 0, 0]},
        {"quality": 0, "state": 2, "pose": None},
    ]
    return {"number": number, "status": 0, "joints_mm": joints_mm, "stations": stations}


def status(silent_s: float, recording: str = "") -> dict[str, Any]:
    second = {"rate_hz": 40.0, "p50_ms": 1.5, "p99_ms": 4.0, "loss": 0.25, "quality": [0.9, 0.0]}
    line = {"lost": [False, True], "silent": silent_s > 0.0, "silent_s": silent_s}
    return {"seconds": [second] * 3, **line, "recording": recording}


def test_the_page_follows_the_session(browser: Any) -> None:
    asked: list[Mapping[str, Any]] = []

    def record(wanted: Mapping[str, Any]) -> Mapping[str, Any]:
        asked.append(wanted)
        if len(asked) > 2:
            raise BadInput("The disk is full.", "Free some space.")
        return {"recording": "a.rec" if wanted["on"] else "", "saved": "a.rec"}

    errors: list[str] = []
    content = LiveContent("a <session>", SKELETON, ("head", "torso"), "token")
    with ViewServer(content.find, {"record": record}, token="token") as server:  # noqa: S106
        tab = browser.new_page(viewport={"width": 700, "height": 900})
        tab.on("pageerror", lambda error: errors.append(str(error)))
        tab.on("request", lambda r: None if r.url.startswith(server.url) else errors.append(r.url))
        tab.goto(server.url)
        tab.wait_for_selector("#player[data-ready]")
        assert tab.inner_text("h1") == "a <session>"
        server.publish("frame", frame(1))
        server.publish("frame", frame(2))
        server.publish("status", status(0.0))
        tab.wait_for_selector("#player[data-drawn='2']", timeout=30_000)
        tab.wait_for_selector("#player[data-status='3']")
        assert tab.locator("#stations li").all_inner_texts() == ["head 90 %", "torso lost"]
        assert tab.inner_text("#alarm") == "lost: torso"
        captions = tab.locator("#charts figcaption").all_inner_texts()
        assert captions == [
            "frames per second: 40.0",
            "lost readings [%]: 25.0",
            "latency, p50 and p99 [ms]: 1.5, 4.0",
            "quality of each station: 0.90 0.00",
        ]
        assert tab.locator("#quality polyline").count() == 2
        assert tab.evaluate("document.documentElement.scrollWidth") <= 700
        server.publish("status", status(0.9))
        tab.wait_for_function("() => document.getElementById('alarm').textContent === 'no data for 0.9 s'")
        tab.click("#record")
        tab.wait_for_function("() => document.getElementById('record').textContent === 'Stop recording'")
        assert tab.inner_text("#said") == "recording into a.rec"
        tab.click("#record")
        tab.wait_for_function("() => document.getElementById('said').textContent === 'saved a.rec'")
        tab.click("#record")
        tab.wait_for_function("() => document.getElementById('said').textContent.startsWith('The disk is full.')")
        assert [wanted["on"] for wanted in asked] == [True, False, True]
    tab.wait_for_function("() => document.getElementById('alarm').textContent === 'the session has ended'")
    tab.close()
    assert not errors


def test_any_number_of_tabs_follow_the_session(browser: Any) -> None:
    """A browser opens six connections to a host. The seventh tab never loaded, since each kept one."""
    content = LiveContent("a session", SKELETON, ("head", "torso"), "token")
    with ViewServer(content.find, token="token") as server, closing(browser.new_context()) as tabs:  # noqa: S106
        server.publish("frame", frame(1))
        opened = [tabs.new_page() for _ in range(9)]
        for tab in opened:
            tab.goto(server.url)
            tab.wait_for_selector("#player[data-drawn='1']", timeout=30_000)
        server.publish("frame", frame(2))
        server.publish("status", status(0.0))
        for tab in opened:
            tab.wait_for_selector("#player[data-drawn='2']", timeout=30_000)
            tab.wait_for_selector("#player[data-status='3']", timeout=30_000)


def test_a_hidden_tab_asks_for_nothing_until_it_is_shown(browser: Any) -> None:
    content = LiveContent("a session", SKELETON, ("head", "torso"), "token")
    with ViewServer(content.find, token="token") as server, closing(browser.new_page()) as tab:  # noqa: S106
        hide = "Object.defineProperty(document, 'hidden', { configurable: true, get: () => window.away })"
        tab.add_init_script(f"window.away = true; {hide}")
        asked: list[str] = []
        tab.on("request", lambda request: asked.append(request.url))
        server.publish("frame", frame(1))
        tab.goto(server.url)
        tab.wait_for_selector("#player[data-ready]")
        tab.wait_for_timeout(500)
        assert not [url for url in asked if "/events" in url]
        tab.evaluate("window.away = false; document.dispatchEvent(new Event('visibilitychange'))")
        tab.wait_for_selector("#player[data-drawn='1']", timeout=30_000)
