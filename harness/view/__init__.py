"""The browser viewer of motion, and movies."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.view.live_page import LiveContent as LiveContent
    from harness.view.movie import MOST_METHODS as MOST_METHODS
    from harness.view.movie import MOVIE_SUFFIXES as MOVIE_SUFFIXES
    from harness.view.movie import MoviePart as MoviePart
    from harness.view.movie import check_movie as check_movie
    from harness.view.movie import write_movie as write_movie
    from harness.view.page import ViewedMotion as ViewedMotion
    from harness.view.page import ViewerContent as ViewerContent
    from harness.view.page import write_page as write_page
    from harness.view.server import COMMAND_HEADER as COMMAND_HEADER
    from harness.view.server import EVENTS_PATH as EVENTS_PATH
    from harness.view.server import Command as Command
    from harness.view.server import Resource as Resource
    from harness.view.server import ViewServer as ViewServer
else:
    __getattr__, __dir__ = lazy_names(__name__)
