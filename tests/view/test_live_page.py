"""The live page in a browser: what it shows of a session, its commands, and what a reader without a token gets."""

import json
from collections.abc import Iterator, Mapping
from contextlib import closing
from itertools import combinations
from typing import Any

import numpy as np
import pytest

from harness.body import build_body, pose_from_qpos, tpose
from harness.core.arrays import Floats
from harness.errors import BadInput
from harness.view.live_page import STATION_COLOURS, STATUS_COLOURS, LiveContent
from harness.view.server import ViewServer

pytestmark = pytest.mark.long
SKELETON = build_body().skeleton


TOKEN = "a-token-of-the-session"  # noqa: S105
TPOSE = tpose(SKELETON)
JOINTS_MM = np.rint(1e3 * np.concatenate([TPOSE[None, :3], pose_from_qpos(SKELETON, TPOSE[None]).end_m[0]]))


def frame(number: int, reach_mm: list[int] | None = None) -> dict[str, Any]:
    joints_mm = JOINTS_MM.astype(int).ravel().tolist()
    return {
        "number": number,
        "joints_mm": joints_mm,
        "stations": [[0, 0, 1500, 1000, 0, 0, 0], None],
        "reach_mm": reach_mm,
    }


def status(word: str = "OK", why: str = "no reading of torso", **more: Any) -> dict[str, Any]:
    seconds = [
        {"rate_hz": 40.0, "p50_ms": 1.5, "p99_ms": 4.0, "loss": 0.25, "quality": [0.9, 0.1 * n]} for n in range(3)
    ]
    stations = ["OK", "LOST"]
    return {"seconds": seconds, "session": word, "why": why, "stations": stations, "uncertainty": "", **more}


def posing(number: int, share: float) -> dict[str, Any]:
    joints_mm = frame(0)["joints_mm"]
    return {
        "kind": "poses", "stage": "posing", "number": number, "poses": 8, "name": "squat", "instruction": "Half squat.",
        "lines": ["hold still"], "still_share": share, "wanted_mm": joints_mm, "performer_mm": joints_mm,
    }  # fmt: skip


class Session:
    """What the page commands: answers as a session does, and refuses a third recording."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, Mapping[str, Any]]] = []

    def commands(self) -> dict[str, Any]:
        return {
            name: lambda wanted, name=name: self.carry_out(name, wanted) for name in ("record", "heading", "calibrate")
        }

    def carry_out(self, name: str, wanted: Mapping[str, Any]) -> Mapping[str, Any]:
        self.asked.append((name, wanted))
        if sum(one == "record" for one, _ in self.asked) > 2:
            raise BadInput("The disk is full.", "Free some space.")
        if name == "record":
            return {"recording": "a.rec" if wanted["on"] else "", "saved": "/out/a.rec"}
        return {"turn_deg": -40.2} if name == "heading" else {}


CONTENT = LiveContent("a <session>", SKELETON, ("head", "torso"), ("tpose", "poses"))


@pytest.fixture
def session() -> Session:
    return Session()


@pytest.fixture
def server(session: Session) -> Iterator[ViewServer]:
    with ViewServer(CONTENT.find, session.commands(), token=TOKEN) as running:
        yield running


@pytest.fixture
def tab(browser: Any, server: ViewServer) -> Iterator[Any]:
    """The page as the starter of the session opens it; an error of it fails the test."""
    errors: list[str] = []
    with closing(browser.new_page(viewport={"width": 700, "height": 900})) as page:
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.on("request", lambda r: None if r.url.startswith(server.url) else errors.append(r.url))
        page.goto(f"{server.url}#{TOKEN}")
        page.wait_for_selector("#player[data-ready]")
        yield page
    assert not errors


def wait_for_text(tab: Any, selector: str, text: str) -> None:
    tab.wait_for_function(f"() => document.querySelector('{selector}').textContent.startsWith({json.dumps(text)})")


AXIS_OFFSETS = """() => [...document.querySelectorAll(".time")].map((axis) => {
  const plots = axis.previousElementSibling.parentElement.querySelectorAll(".plot svg");
  const left = plots[0].getBoundingClientRect().left, words = document.createRange();
  words.selectNodeContents(axis.firstChild);
  return words.getBoundingClientRect().left - left;
})"""
"""How far each time axis begins to the right of its chart [px]."""


def test_the_page_follows_the_session(tab: Any, server: ViewServer) -> None:
    assert tab.inner_text("h1") == "a <session>"
    assert tab.locator("#session").all_inner_texts()[0].split("\n") == ["LOST", "no pose yet"]
    server.publish("frame", frame(1))
    server.publish("frame", frame(2))
    server.publish("status", status())
    tab.wait_for_selector("#player[data-drawn='2']", timeout=30_000)
    tab.wait_for_selector("#player[data-status='3']")
    assert tab.inner_text("#session").split("\n") == ["OK", "no reading of torso"]
    rows = tab.locator("#stations li")
    assert [row.inner_text().split()[:3] for row in rows.all()] == [["head", "OK", "90"], ["torso", "LOST", "20"]]
    captions = tab.locator("#charts figcaption").all_inner_texts()
    assert captions == ["Poses: 40.0 Hz", "Readings lost: 25.0 %", "Latency p50, p99 (dashed): 1.5 and 4.0 ms"]
    for plot, top in zip(tab.locator(".plot .top").all(), ["100 %", "100 %", "40 Hz", "30 %", "4 ms"], strict=True):
        assert plot.inner_text() == top
    assert tab.locator(".plot .zero").all_inner_texts() == ["0"] * 5
    assert [axis.split() for axis in tab.locator(".time").all_inner_texts()] == [
        ["60", "s", "ago", "30", "s", "now"]
    ] * 4
    for width in (700, 1400, 330):
        tab.set_viewport_size({"width": width, "height": 900})
        assert tab.evaluate(AXIS_OFFSETS) == pytest.approx([0.0] * 4, abs=1.5), "a time axis begins below its chart"
    tab.set_viewport_size({"width": 700, "height": 900})
    assert tab.locator("#stations .line").count() == 2, "each station has a chart of its own"
    assert tab.locator(".names span").all_inner_texts() == ["head"], "the station that is lost is not drawn"
    assert tab.evaluate("document.documentElement.scrollWidth") <= 700
    server.publish("status", status("LOST", "no data for 0.9 s"))
    wait_for_text(tab, "#session", "LOST")
    assert tab.inner_text("#session span") == "no data for 0.9 s"
    server.board.close()
    wait_for_text(tab, "#session span", "the session has ended")


PIXELS = """() => {
  const c = document.querySelector("#player canvas"), gl = c.getContext("webgl2");
  const out = new Uint8Array(4 * c.width * c.height), last = window.seen || out;
  gl.readPixels(0, 0, c.width, c.height, gl.RGBA, gl.UNSIGNED_BYTE, out);
  window.seen = out;
  const changed = [0, 0, 0, 0], half = (share) => Math.floor(2 * share);
  for (let i = 0; i < out.length; i += 4) {
    if (out[i] !== last[i]) changed[2 * half(i / out.length) + half(((i / 4) % c.width) / c.width)] += 1;
  }
  return changed;
}"""
"""Numbers of pixels whose red is not that of the last call: below left and right, above left and right."""


def test_the_stated_uncertainty_is_drawn_about_the_bones(tab: Any, server: ViewServer) -> None:
    """The left arm alone is uncertain; the performer faces the camera, so it is on the right of the picture."""

    def draw(number: int, arm_mm: int, text: str) -> list[int]:
        reach_mm = [arm_mm * (name == "lhumerus") for name in SKELETON.names] if arm_mm else None
        server.publish("status", status(uncertainty=text))
        wait_for_text(tab, "#uncertainty output", text)
        server.publish("frame", frame(number, reach_mm))
        tab.wait_for_selector(f"#player[data-drawn='{number}']", timeout=30_000)
        changed: list[int] = tab.evaluate(PIXELS)
        return changed

    draw(1, 0, "none")
    assert draw(2, 0, "none again") == [0, 0, 0, 0]
    *narrow_elsewhere, narrow = draw(3, 1, "stated")
    assert tab.is_visible("#uncertainty i")
    draw(4, 0, "none at last")
    assert not tab.is_visible("#uncertainty i")
    *wide_elsewhere, wide = draw(5, 150, "stated again")
    assert narrow_elsewhere == wide_elsewhere == [0, 0, 0], "the region is that of the arm alone, without a shadow"
    assert wide > 2 * narrow > 0


def test_no_text_is_small_and_words_can_be_read(tab: Any, server: ViewServer) -> None:
    """Also at 700 pixels and on a dark screen; the word of the session is the largest text of the page."""
    server.publish("frame", frame(1))
    server.publish("status", status())
    server.publish("calibration", posing(1, 0.5))
    tab.wait_for_selector("#player[data-status='3']")
    sizes = """[...document.querySelectorAll('body *')]
        .filter((e) => e.checkVisibility() && [...e.childNodes].some((n) => n.nodeType === 3 && n.data.trim()))
        .map((e) => [parseFloat(getComputedStyle(e).fontSize), e.textContent])"""
    texts = sorted(tab.evaluate(sizes))
    assert texts[0][0] >= 11.0, texts[0]
    assert texts[-1][1] == "OK"
    for scheme in ("light", "dark"):
        tab.emulate_media(color_scheme=scheme)
        for word in STATUS_COLOURS:
            tab.evaluate(f"document.getElementById('session').dataset.word = '{word}'")
            style = "(() => {{ const s = getComputedStyle(document.getElementById('session')); return s.{}; }})()"
            ink, ground = (tab.evaluate(style.format(name)) for name in ("color", "backgroundColor"))
            assert contrast(channels(ink), channels(ground)) > 4.5


def test_commands_are_sent_and_their_answers_shown(tab: Any, server: ViewServer, session: Session) -> None:
    server.publish("frame", frame(1))
    tab.wait_for_selector("#player[data-drawn='1']", timeout=30_000)
    assert "#" not in tab.url, "the address bar does not keep the token"
    tab.click("#heading")
    wait_for_text(tab, "#said", "heading reset by -40°")
    tab.click("#record")
    wait_for_text(tab, "#said", "recording into a.rec")
    assert tab.inner_text("#record") == "Stop recording"
    tab.keyboard.press("r")
    wait_for_text(tab, "#said", "saved /out/a.rec")
    tab.reload()
    tab.wait_for_selector("#player[data-ready]")
    tab.keyboard.press("h")
    wait_for_text(tab, "#said", "heading reset by -40°")
    tab.click("#record")
    wait_for_text(tab, "#said", "The disk is full.")
    server.publish("status", status(recording="", failure="It was pulled out."))
    wait_for_text(tab, "#said", "the recording has ended: It was pulled out.")
    names = [name for name, _ in session.asked]
    assert names == ["heading", "record", "record", "heading", "record"]
    assert [wanted["on"] for name, wanted in session.asked if name == "record"] == [True, False, True]


def test_a_calibration_is_guided(tab: Any, server: ViewServer, session: Session) -> None:
    server.publish("frame", frame(1))
    tab.wait_for_selector("#player[data-drawn='1']", timeout=30_000)
    assert not tab.is_visible("#calibration")
    tab.click("[data-kind=poses]")
    server.publish("calibration", posing(7, 0.4))
    tab.wait_for_selector("#player[data-drawn='pose 7']", timeout=30_000)
    assert tab.inner_text("#calibration h2") == "Pose 7 of 8: squat"
    assert tab.inner_text("#calibration .instruction") == "Half squat."
    assert tab.evaluate("document.querySelector('#calibration progress').value") == 0.4
    assert tab.locator(".names span").all_inner_texts() == ["pose 7", "you"]
    assert tab.locator("[data-kind]").all_inner_texts() == ["Calibrate: T-pose", "Stop calibration"]
    assert tab.is_disabled("[data-kind=tpose]")
    tab.click("[data-kind=poses]")
    done = {"kind": "poses", "stage": "done", "lines": ["good", "Saved a.toml."], "report": "bone [mm]"}
    server.publish("calibration", done)
    wait_for_text(tab, "#calibration h2", "Calibrated")
    assert tab.locator("#calibration li").all_inner_texts() == ["good", "Saved a.toml."]
    assert tab.text_content("#calibration pre") == "bone [mm]"
    server.publish("frame", frame(2))
    tab.wait_for_selector("#player[data-drawn='2']", timeout=30_000)
    assert session.asked == [("calibrate", {"kind": "poses"}), ("calibrate", {"kind": ""})]


@pytest.mark.parametrize("fragment", ["", "#wrong"])
def test_a_reader_without_the_token_looks_on(browser: Any, server: ViewServer, session: Session, fragment: str) -> None:
    with closing(browser.new_page()) as page:
        server.publish("frame", frame(1))
        page.goto(f"{server.url}{fragment}")
        page.wait_for_selector("#player[data-drawn='1']", timeout=30_000)
        if fragment:
            page.click("#heading")  # which the server refuses
        page.wait_for_selector("#reader:not([hidden])")
        assert page.inner_text("#reader").startswith("You can look and not command.")
        assert not any(button.is_visible() for button in page.locator(".controls button").all())
        page.keyboard.press("h")
        page.goto(f"{server.url}#{TOKEN}")
        page.wait_for_selector("#heading:not([hidden])")
        assert not session.asked


MACHADO_2009 = {
    "deuteranopia": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "protanopia": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "tritanopia": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
    "none": np.eye(3).tolist(),
}
"""Linear RGB as people see it who lack a kind of cone (Machado, Oliveira, Fernandes 2009, severity 1)."""


@pytest.mark.parametrize("seen", MACHADO_2009.values(), ids=MACHADO_2009)
def test_no_colour_can_be_taken_for_another(seen: list[list[float]]) -> None:
    def lab(colour: str) -> Floats:
        xyz_from_rgb = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
        xyz = xyz_from_rgb @ np.clip(np.array(seen) @ linear(channels(colour)), 0.0, 1.0) / [0.9505, 1.0, 1.089]
        x, y, z = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16.0 / 116.0)
        return np.array([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])

    colours = [*STATUS_COLOURS.values(), *STATION_COLOURS]
    assert len(set(colours)) == 9
    for one, other in combinations(colours, 2):
        assert np.linalg.norm(lab(one) - lab(other)) > 17.0, (one, other)
    for colour in STATION_COLOURS:
        for page in ("#ffffff", "#14171b"):
            assert contrast(channels(colour), channels(page)) > 2.9


def channels(colour: str) -> Floats:
    """Red, green and blue, 0 to 1, of "#rrggbb" or "rgb(r, g, b)"."""
    if colour.startswith("#"):
        return np.array([int(colour[at : at + 2], 16) for at in (1, 3, 5)]) / 255.0
    return np.array([float(part) for part in colour.strip("rgba()").split(",")[:3]]) / 255.0


def linear(rgb: Floats) -> Floats:
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def contrast(one: Floats, other: Floats) -> float:
    """Contrast of two colours as in WCAG 2."""
    low, high = sorted(float(linear(rgb) @ [0.2126, 0.7152, 0.0722]) for rgb in (one, other))
    return (high + 0.05) / (low + 0.05)


def test_any_number_of_tabs_follow_the_session(browser: Any) -> None:
    """A browser opens six connections to a host. The seventh tab never loaded, since each kept one."""
    with ViewServer(CONTENT.find) as server, closing(browser.new_context()) as tabs:
        server.publish("frame", frame(1))
        opened = [tabs.new_page() for _ in range(9)]
        for tab in opened:
            tab.goto(server.url)
            tab.wait_for_selector("#player[data-drawn='1']", timeout=30_000)
        server.publish("frame", frame(2))
        server.publish("status", status())
        for tab in opened:
            tab.wait_for_selector("#player[data-drawn='2']", timeout=30_000)
            tab.wait_for_selector("#player[data-status='3']", timeout=30_000)


def test_a_hidden_tab_asks_for_nothing_until_it_is_shown(browser: Any) -> None:
    with ViewServer(CONTENT.find) as server, closing(browser.new_page()) as tab:
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
