"""The browser viewer of motion, and movies."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.view.live_page import LiveContent
    from harness.view.movie import MOST_METHODS, MOVIE_SUFFIXES, MoviePart, check_movie, write_movie
    from harness.view.page import ViewedMotion, ViewerContent, write_page
    from harness.view.server import COMMAND_HEADER, EVENTS_PATH, Command, Resource, ViewServer
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "COMMAND_HEADER",
    "EVENTS_PATH",
    "MOST_METHODS",
    "MOVIE_SUFFIXES",
    "Command",
    "LiveContent",
    "MoviePart",
    "Resource",
    "ViewServer",
    "ViewedMotion",
    "ViewerContent",
    "check_movie",
    "write_movie",
    "write_page",
]
