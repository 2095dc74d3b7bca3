"""The 3-D player in a browser: camera, time, methods next to each other, and links to a moment."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.core.humanoid24 import BONES, pack
from harness.mocap.synthetic import generate
from harness.report.kit.document import html_document
from harness.report.kit.motion_player import (
    NO_ESTIMATE,
    PlayerClip,
    PlayerMoment,
    PlayerMotion,
    PlayerStations,
    PlayerTrack,
    player_card,
)
from harness.score import compute_poses

pytestmark = pytest.mark.long
FRAMES, RATE_HZ = 80, 40.0
METHODS = ("ik", "map", "pca")
LOST_FRAME = 30
CAMERA = "() => { const c = player.player.camera; return [c.azimuth, c.elevation, c.distance, ...c.offset]; }"
PIXELS = """() => {
  const c = player.player.canvas, gl = player.player.renderer.gl, out = new Uint8Array(4 * c.width * c.height);
  gl.readPixels(0, 0, c.width, c.height, gl.RGBA, gl.UNSIGNED_BYTE, out);
  const seen = [0, 0, 0];
  for (let i = 0; i < out.length; i += 4) {
    if (out[i] - out[i + 2] > 60) seen[Math.floor((3 * ((i / 4) % c.width)) / c.width)] += 1;
  }
  return seen;
}"""
"""Numbers of reddish pixels in the left, middle and right third of the picture."""


@pytest.fixture(scope="module")
def page_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page with two clips of three methods, whose errors are 30, 60 and 90 mm to the left."""
    clips = []
    for behaviour in ("walking", "boxing"):
        made = generate(behaviour, "p1", 1, seed=1, duration_s=FRAMES / RATE_HZ, rate_hz=RATE_HZ)
        skeleton, dofs = made.skeleton.subset(BONES)
        motion = compute_poses(skeleton, pack(made.root_m, made.world_from_root, made.angles_rad[:, dofs])[:FRAMES])
        solved = np.zeros(FRAMES, dtype=np.int64)
        states = np.where(np.arange(FRAMES) == LOST_FRAME, NO_ESTIMATE, 0)
        offsets = [np.array([0.0, 0.03 * n, 0.0]) for n in (1, 2, 3)]
        tracks = [PlayerTrack(n, motion.joints_m + o, states) for n, o in zip(METHODS, offsets, strict=True)]
        tracks[1] = replace(tracks[1], region_deg=np.linspace(4.0, 20.0, FRAMES))
        pose = np.tile([1.0, 0.0, 0.0, 0.0], (FRAMES, 1, 1))
        quality = np.where(np.arange(FRAMES) < FRAMES // 2, 1.0, 0.5)[:, None]
        stations = PlayerStations(("head",), motion.joints_m[:, 6:7], pose, solved[:, None], quality)
        time_s = np.arange(FRAMES) / RATE_HZ
        truth = PlayerTrack("truth", motion.joints_m, solved)
        clips.append(PlayerClip(behaviour, behaviour, time_s, 0.0, truth, tracks, stations))
    moment = PlayerMoment("map: worst", 1, "map", 0.5, 0.6)
    player = player_card(PlayerMotion(skeleton, clips, [moment]), "bodies")
    page = html_document(
        title="t", kicker="k", heading="h", facts={}, missing=[], sections=[("In 3-D", "look", player)]
    )
    path = tmp_path_factory.mktemp("player") / "page.html"
    path.write_text(page, encoding="utf-8")
    return path


@pytest.fixture
def page(browser: Any, page_file: Path) -> Iterator[Any]:
    """The page with its player ready; it must not fail or ask for anything."""
    errors: list[str] = []
    opened = browser.new_page(viewport={"width": 700, "height": 800})
    opened.on("pageerror", lambda error: errors.append(str(error)))
    opened.on("request", lambda r: None if r.url.startswith(page_file.as_uri()) else errors.append(r.url))
    opened.goto(page_file.as_uri())
    _wait_until_ready(opened)
    yield opened
    opened.close()
    assert not errors


def _wait_until_ready(opened: Any) -> None:
    opened.locator("#player").scroll_into_view_if_needed()
    opened.wait_for_selector("#player[data-ready]", timeout=60_000)
    opened.wait_for_selector("#player[data-drawn]", timeout=60_000)


def _middle(page: Any) -> tuple[float, float]:
    box = page.locator(".stage").bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def _drag(page: Any, dx: float, dy: float, button: str = "left") -> None:
    x, y = _middle(page)
    page.mouse.move(x, y)
    page.mouse.down(button=button)
    page.mouse.move(x + dx, y + dy, steps=4)
    page.mouse.up(button=button)


def _where(page: Any) -> str:
    return str(page.inner_text(".motion-player output:not(.said)"))


def _choose(page: Any, **values: str) -> None:
    for name, value in values.items():
        page.select_option(f"select[name={name}]", value)
    page.wait_for_function("n => player.player.shown.length === n", arg=1 + len(values))


def test_dragging_turns_the_camera_and_cannot_turn_it_over(page: Any) -> None:
    before = page.evaluate(CAMERA)
    _drag(page, 100, 0)
    after = page.evaluate(CAMERA)
    assert after[0] < before[0] - 0.5
    assert after[1:] == before[1:]
    for _ in range(3):
        _drag(page, 0, 250)
    assert page.evaluate(CAMERA)[1] == pytest.approx(1.5)
    for _ in range(4):
        _drag(page, 0, -250)
    assert page.evaluate(CAMERA)[1] == pytest.approx(-0.17)
    page.click("button[name=reset]")
    assert page.evaluate(CAMERA) == before


def test_the_wheel_zooms_within_limits(page: Any) -> None:
    page.wait_for_timeout(300)
    page.mouse.move(*_middle(page))
    before = page.evaluate(CAMERA)[2]
    page.mouse.wheel(0, -100)
    page.wait_for_function(f"before => ({CAMERA})()[2] < 0.95 * before", arg=before)
    for _ in range(20):
        page.mouse.wheel(0, -1000)
    page.wait_for_function(f"() => ({CAMERA})()[2] === 0.4")
    for _ in range(20):
        page.mouse.wheel(0, 1000)
    page.wait_for_function(f"() => ({CAMERA})()[2] === 30")


def test_a_page_that_is_scrolled_goes_on_scrolling(page: Any) -> None:
    before = page.evaluate(CAMERA)
    turn = "player.player.stage.dispatchEvent(new WheelEvent('wheel', { deltaY: -100 }))"
    page.evaluate(f"() => {{ dispatchEvent(new Event('scroll')); {turn}; }}")
    assert page.evaluate(CAMERA) == before


@pytest.mark.parametrize("button", ["right", "middle"])
def test_other_buttons_pan(page: Any, button: str) -> None:
    before = page.evaluate(CAMERA)
    _drag(page, 0, 60, button)
    after = page.evaluate(CAMERA)
    assert after[:3] == before[:3]
    assert after[5] > 0.1, "the target moves up when the picture is dragged down"


def test_two_fingers_zoom(page: Any) -> None:
    x, y = _middle(page)
    touch = """([x, y, apart]) => {
      const put = (name, pointerId, clientX) => player.player.stage.dispatchEvent(
        new PointerEvent(name, { pointerId, clientX, clientY: y, pointerType: 'touch', buttons: 1 }));
      player.player.stage.setPointerCapture = () => {};
      put('pointerdown', 1, x - 50); put('pointerdown', 2, x + 50);
      put('pointermove', 1, x - apart); put('pointermove', 2, x + apart);
      put('pointerup', 1, x - apart); put('pointerup', 2, x + apart);
    }"""
    before = page.evaluate(CAMERA)
    page.evaluate(touch, [x, y, 100])
    after = page.evaluate(CAMERA)
    assert after[2] == pytest.approx(before[2] / 2)
    assert after[:2] == before[:2]


def test_keys_step_and_play(page: Any) -> None:
    stage = page.locator(".stage")
    assert _where(page) == f"frame 1 of {FRAMES} · 0.000 s"
    stage.press("ArrowRight")
    assert _where(page) == f"frame 2 of {FRAMES} · 0.025 s"
    stage.press("End")
    assert _where(page).startswith(f"frame {FRAMES} of")
    stage.press("ArrowLeft")
    assert _where(page).startswith(f"frame {FRAMES - 1} of")
    stage.press("Home")
    before = page.evaluate(CAMERA)
    stage.press("Shift+ArrowUp")
    stage.press("+")
    after = page.evaluate(CAMERA)
    assert after[1] == pytest.approx(before[1] + 0.1)
    assert after[2] == pytest.approx(0.9 * before[2])
    page.evaluate("player.player.speed.value = 0.25")  # on a busy machine the end must not come before the second key
    stage.press(" ")
    page.wait_for_function("() => player.player.frame > 4")
    stage.press(" ")
    assert page.inner_text("button[name=run]") == "Play"


def test_speed_scales_the_time(page: Any) -> None:
    """Frames in the same wall time at 0.1 and at 2 times the speed."""
    run = """async (speed) => {
      const p = player.player;
      p.speed.value = speed; p.seek(0); p.play();
      const began = performance.now();
      await new Promise((done) => {
        const look = () => (performance.now() - began > 500 ? done() : requestAnimationFrame(look));
        look();
      });
      p.stop();
      return p.time[p.frame];
    }"""
    assert page.evaluate(run, "0.1") <= 0.2
    assert page.evaluate(run, "2") >= 0.5


def test_three_methods_stand_next_to_each_other(page: Any) -> None:
    _choose(page, method1="map", method2="pca")
    page.wait_for_function("() => document.querySelectorAll('.labels > div').length === 3")
    labels = page.locator(".labels > div").all_inner_texts()
    assert [text.split() for text in labels] == [
        ["ik", "30", "mm", "head"],
        ["map", "60", "mm", "·", "stated", "±4°", "head"],
        ["pca", "90", "mm", "head"],
    ]
    page.locator("input[name=errors]").check()
    page.wait_for_timeout(500)
    ik, _, pca = page.evaluate(PIXELS)
    assert pca > ik + 100, "large errors are red"
    page.select_option("select[name=layout]", "over")
    page.wait_for_function("() => document.querySelectorAll('.labels > div').length === 1")
    assert page.locator(".labels > div").inner_text().count("mm") == 3


def test_a_frame_without_an_estimate_says_so(page: Any) -> None:
    page.locator(".motion-player input[type=range]").fill(str(LOST_FRAME))
    page.wait_for_function("n => player.dataset.drawn === String(n)", arg=LOST_FRAME)
    assert page.locator(".labels").inner_text().split("\n") == ["ik · no estimate", "head"]


def test_the_worst_seconds_are_played(page: Any) -> None:
    page.select_option("select[name=moment]", "0")
    page.wait_for_function("() => player.player.playing === false && player.player.time[player.player.frame] >= 0.59")
    assert page.locator("select[name=clip]").input_value() == "1"
    assert page.locator("select[name=method0]").input_value() == "map"
    assert page.evaluate("() => player.player.time[player.player.frame]") < 0.61


def test_a_link_restores_the_moment(page: Any, page_file: Path, browser: Any) -> None:
    page.select_option("select[name=clip]", "1")
    page.wait_for_function("() => player.player.now.name === 'boxing'")
    _choose(page, method1="pca")
    page.locator("input[name=errors]").check()
    page.locator("input[name=stations]").uncheck()
    page.select_option("select[name=layout]", "over")
    page.locator(".motion-player input[type=range]").fill("50")
    _drag(page, 70, 30)
    page.click("button[name=link]")
    expected = page.evaluate("player.player.state()")
    assert "#view?" in page.url
    opened = browser.new_page(viewport={"width": 1400, "height": 800})
    opened.goto(page.url)
    _wait_until_ready(opened)
    assert opened.evaluate("player.player.state()") == expected
    assert _where(opened).startswith("frame 51 of")
    np.testing.assert_allclose(opened.evaluate(CAMERA), page.evaluate(CAMERA), atol=1e-3)
    opened.goto(page_file.as_uri() + "#view?clip=walking&method=map&t=0.25&camera=broken")
    opened.wait_for_function("() => player.player.now.name === 'walking' && player.player.frame === 10")
    assert opened.locator("select[name=method0]").input_value() == "map"
    opened.close()


def test_the_picture_is_printed_in_light_colours(page: Any) -> None:
    page.emulate_media(media="print", color_scheme="dark")
    assert page.locator(".stage").is_visible()
    assert not page.locator(".motion-player .controls").first.is_visible()


def test_the_view_is_unpacked_only_when_it_is_seen(browser: Any, page_file: Path, tmp_path: Path) -> None:
    far = tmp_path / "far.html"
    text = page_file.read_text(encoding="utf-8").replace("<main>", '<main><div style="height: 3000px"></div>')
    far.write_text(text, encoding="utf-8")
    opened = browser.new_page(viewport={"width": 700, "height": 800})
    opened.goto(far.as_uri())
    opened.wait_for_timeout(300)
    assert not opened.evaluate("'ready' in player.dataset")
    opened.emulate_media(media="print")
    assert opened.locator(".player-note").is_visible()
    opened.emulate_media(media="screen")
    _wait_until_ready(opened)
    opened.close()


def test_a_body_is_there_before_the_scripts_run(browser: Any, page_file: Path) -> None:
    context = browser.new_context(java_script_enabled=False, viewport={"width": 700, "height": 800})
    still = context.new_page()
    still.goto(page_file.as_uri())
    box = still.locator("#player .waiting").bounding_box()
    assert box["height"] > 200
    assert still.locator("#player .waiting polygon").count() > 20
    context.close()


def test_the_standing_body_gives_way_to_the_motion(page: Any) -> None:
    assert page.locator("#player .waiting").is_hidden()
    assert page.locator("#player canvas").is_visible()


def test_signals_lie_under_the_time_line_and_lead_to_their_moment(page: Any) -> None:
    texts = page.locator(".signals span").all_inner_texts()
    assert [text.partition(" [")[0] for text in texts] == ["error", "lowest quality", "stations read"]
    assert texts[0] == "error [mm], 0 to 30"
    error, quality, _ = page.locator(".signals path").evaluate_all(
        "(paths) => paths.map((each) => each.getAttribute('d'))"
    )
    assert error.count("M") == 2  # the frame without an estimate leaves a gap
    heights = [float(point.split()[1]) for point in quality.lstrip("M").split("L")]
    assert (heights[0], heights[-1]) == (2.0, 16.0)
    box = page.locator(".signal").nth(1).bounding_box()
    page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 10)
    assert page.evaluate("player.player.frame") == pytest.approx(0.5 * (FRAMES - 1), abs=2)


def test_a_method_that_states_its_uncertainty_has_it_beside_its_name_and_as_a_signal(page: Any) -> None:
    page.select_option("select[name=method0]", "map")
    page.wait_for_function("() => document.querySelectorAll('.signal').length === 4")
    texts = page.locator(".signals > div > span").all_inner_texts()
    assert texts[1] == "stated 95 % region [±°], 0 to 20"
    line = page.locator(".signals path").nth(1).get_attribute("d")
    heights = [float(point.split()[1]) for part in line.split("M") if part for point in part.split("L")]
    assert [heights[0], heights[-1]] == pytest.approx([30.0 - 28.0 * 0.2, 2.0], abs=0.1)
    assert line.count("M") == 2, "the frame without an estimate leaves a gap"
    page.keyboard.press("Home")
    page.wait_for_function("() => document.querySelector('.labels').innerText.includes('map 60 mm · stated ±4°')")
    page.locator(".motion-player input[type=range]").fill(str(LOST_FRAME))
    page.wait_for_function("n => player.dataset.drawn === String(n)", arg=LOST_FRAME)
    assert "stated" not in page.locator(".labels").inner_text()


def test_stations_have_their_names_where_they_are(page: Any) -> None:
    name = page.locator(".labels .station")
    name.wait_for()
    assert name.all_inner_texts() == ["head"]
    page.wait_for_function(
        """() => {
          const place = (s) => document.querySelector(s).getBoundingClientRect();
          const stage = place(".stage"), at = place(".labels .station");
          return stage.x < at.x && at.x < stage.right && stage.y < at.y && at.y < stage.y + 0.5 * stage.height;
        }"""
    )
    page.locator("input[name=names]").uncheck()
    page.wait_for_function("() => !document.querySelector('.labels .station')")
