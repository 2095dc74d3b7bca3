"""The viewer's page: the 3-D player over the whole window, with its motion fetched from the server."""

import json
import threading
from collections.abc import Callable, Sequence
from importlib.resources import files
from typing import Any

from harness.core.progress import ProgressCallback
from harness.core.skeleton import Skeleton
from harness.errors import UnknownName
from harness.report.kit import (
    Markup,
    PlayerClip,
    PlayerMotion,
    describe_body,
    html_document,
    join,
    pack_clip,
    page_style,
    player_card,
    player_element,
    player_script,
    tag,
)
from harness.view.server import COMMAND_HEADER, Resource

_CHUNK_FRAMES = 6000
"""Frames of one chunk: 50 s at 120 Hz [choice]."""
_JSON, _JAVASCRIPT = "application/json", "text/javascript; charset=utf-8"


class ViewedMotion:
    """Clips by name, each made when it is first looked at."""

    def __init__(
        self,
        title: str,
        skeleton: Skeleton,
        names: Sequence[str],
        make: Callable[[int], PlayerClip],
        note: str = "",
        shown: Sequence[str] = (),
    ) -> None:
        """`make` makes the clip of that number; `note` stands above the player; `shown` are the methods to begin with.

        Without `shown`, the first method of the clip is shown.
        """
        self.title, self.skeleton, self.names, self.note, self.shown = title, skeleton, tuple(names), note, tuple(shown)
        self._make, self._clips, self._lock = make, dict[int, PlayerClip](), threading.Lock()

    def clip(self, number: int) -> PlayerClip:
        """The clip of a number; the same object each time."""
        with self._lock:
            if number not in self._clips:
                self._clips[number] = self._make(number)
            return self._clips[number]

    def beginning_with(self, name: str) -> "ViewedMotion":
        """A copy whose first clip has this name; UnknownName if there is none."""
        if name not in self.names:
            raise UnknownName("clip", name, self.names)
        first = self.names.index(name)
        order = [first, *(n for n in range(len(self.names)) if n != first)]
        names = [self.names[n] for n in order]
        return ViewedMotion(self.title, self.skeleton, names, lambda n: self.clip(order[n]), self.note, self.shown)

    def whole(self, progress: ProgressCallback = lambda clip, done, planned: None) -> PlayerMotion:
        """All clips at once; `progress` is called after each."""
        clips = []
        for number, name in enumerate(self.names):
            clips.append(self.clip(number))
            progress(name, number + 1, len(self.names))
        return PlayerMotion(self.skeleton, clips, shown=self.shown)


class ViewerContent:
    """What the server answers for a viewed motion: page, scripts, descriptions of clips and their chunks."""

    def __init__(self, motion: ViewedMotion, token: str) -> None:
        self.motion = motion
        description = {
            **describe_body(motion.skeleton),
            "shown": motion.shown,
            "clips": [{"name": name, "title": name, "href": f"/clip/{n}.json"} for n, name in enumerate(motion.names)],
        }
        viewer = files(__package__).joinpath("viewer.js").read_text(encoding="utf-8")
        self._resources = {
            "/": Resource("text/html; charset=utf-8", _page(motion, token)),
            "/viewer.css": Resource("text/css; charset=utf-8", page_style().encode()),
            "/viewer.js": Resource(_JAVASCRIPT, f"{player_script()}\n{viewer}".encode()),
            "/motion.json": Resource(_JSON, json.dumps(description).encode()),
        }
        self._clip_paths = {f"/clip/{n}.json": n for n in range(len(motion.names))}
        self._lock = threading.Lock()

    def find(self, path: str) -> Resource | None:
        """The content of an address. The description of a clip is made with the clip's chunks, once."""
        with self._lock:
            if path not in self._resources and path in self._clip_paths:
                self._resources[path] = self._describe_clip(self._clip_paths[path])
            return self._resources.get(path)

    def add(self, path: str, resource: Resource) -> None:
        """Serve something more, such as a movie that was made."""
        with self._lock:
            self._resources[path] = resource

    def _describe_clip(self, number: int) -> Resource:
        def write(data: bytes) -> str:
            path = f"/clip/{number}/{sum(path.startswith(f'/clip/{number}/') for path in self._resources)}"
            self._resources[path] = Resource("application/octet-stream", data)
            return path

        packed = pack_clip(self.motion.skeleton, self.motion.clip(number), write, _CHUNK_FRAMES)
        return Resource(_JSON, json.dumps(packed).encode())


def viewer_page(title: str, kicker: str, style: str, *parts: Markup | None, script: str, token: str) -> bytes:
    """The page of a viewer: parts below a header, and a script that carries the token of its commands."""
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
        tag("title", f"{title}: {kicker}"),
        tag("link", rel="icon", href="data:,"),
        tag("link", rel="stylesheet", href="/viewer.css"),
        tag("style", Markup(_BODY_STYLE + style)),
    )
    body = tag(
        "body",
        tag("header", tag("p", kicker, class_="kicker"), tag("h1", title)),
        *parts,
        tag("script", src=script, data_token=token, data_header=COMMAND_HEADER, id_="viewer"),
    )
    return f"<!doctype html>\n{tag('html', head, body, lang='en')}\n".encode()


def _page(motion: ViewedMotion, token: str) -> bytes:
    note = tag("p", motion.note) if motion.note else None
    player = player_element("Bodies and stations in 3-D; drag to turn")
    return viewer_page(motion.title, "harness view", _STYLE, note, player, script="/viewer.js", token=token)


_BODY_STYLE = """
body { max-width: 100rem; padding: 0.8rem clamp(0.6rem, 2vw, 1.6rem); }
header { display: flex; flex-wrap: wrap; align-items: baseline; gap: 0.2rem 1rem; }"""
_STYLE = """
h1 { margin: 0 0 0.4rem; font-size: 1.2rem; }
.motion-player .stage { height: max(19rem, calc(100vh - 17rem)); }
"""


def write_page(motion: ViewedMotion, progress: ProgressCallback = lambda clip, done, planned: None) -> str:
    """The HTML of a page that holds all its data and loads nothing; `progress` is called after each clip."""
    player = player_card(motion.whole(progress), "Bodies and stations in 3-D; drag to turn")
    note: Any = tag("p", motion.note) if motion.note else None
    return html_document(
        title=f"{motion.title}: harness view",
        kicker="harness view",
        heading=motion.title,
        facts={},
        missing=[],
        sections=[("In 3-D", "look", join(note, player))],
    )
