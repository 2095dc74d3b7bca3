"""The outputs that a user asks for, opened one after another."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from harness.core.interrupts import defer_interrupts
from harness.errors import BadInput
from harness.live.browser_view import BrowserOutput
from harness.live.file_outputs import BvhOutput, PoseTableOutput
from harness.live.lsl import LslOutput
from harness.live.pose import Output, SessionSetup
from harness.live.session_control import SessionControl
from harness.live.viewer import ViewerOutput
from harness.live.vmc import VmcOutput
from harness.live.vrpn_output import VrpnOutput


@dataclass(frozen=True)
class OutputOptions:
    """Where the poses of a live session go; BadInput for options that need another one."""

    vmc: str | None = None
    """[HOST:]PORT that receives the VMC protocol."""
    lsl: str | None = None
    """Name of the streams of the Lab Streaming Layer."""
    vrpn: str | None = None
    """NAME[@[HOST:]PORT] of trackers that are served by VRPN."""
    anywhere: bool = False
    """Whether those streams and trackers are open to other computers too."""
    bvh: Path | None = None
    poses: Path | None = None
    """Table of poses and frame times."""
    view: Literal["window", "browser", "frames"] | None = None
    no_browser: bool = False
    """Whether the page of the view "browser" is served, but not opened."""
    out: Path | None = None
    """Folder of the pictures of the view "frames", and of recordings and calibrations from the view "browser"."""
    force: bool = False
    """Whether files that exist are replaced."""

    def __post_init__(self) -> None:
        if self.out is not None and self.view not in ("frames", "browser"):
            raise BadInput("--out without --view frames or browser.", "Give both, or neither.")
        if self.no_browser and self.view != "browser":
            raise BadInput("--no-browser without --view browser.", "Give both, or neither.")
        if self.anywhere and self.lsl is None and self.vrpn is None:
            raise BadInput("--anywhere without --lsl or --vrpn.", "Name the streams with --lsl or --vrpn.")


def open_outputs(
    options: OutputOptions,
    setup: SessionSetup,
    control: SessionControl,
    opened: ExitStack,
    say: Callable[[str], None] = lambda text: None,
) -> list[Output]:
    """Open the requested outputs; `opened` closes them again, also when a later one is refused.

    `say` receives a line on each of them. `control` is what the page of the view "browser" commands.
    """
    outputs: list[Output] = []
    waiting = _requested_outputs(options, setup, control, say)
    while True:
        with defer_interrupts():
            output = next(waiting, None)
            if output is None:
                return outputs
            outputs.append(output)
            opened.callback(output.close)
        say(output.description)


def _requested_outputs(
    options: OutputOptions, setup: SessionSetup, control: SessionControl, say: Callable[[str], None]
) -> Iterator[Output]:
    """Open each output when it is asked for."""
    if options.vmc is not None:
        yield VmcOutput(options.vmc, setup.skeleton)
    if options.lsl is not None:
        yield LslOutput(options.lsl, setup.skeleton, setup.rate_hz, network=options.anywhere)
    if options.vrpn is not None:
        yield VrpnOutput(options.vrpn, setup, anywhere=options.anywhere, say=say)
    if options.bvh is not None:
        yield BvhOutput(options.bvh, setup.skeleton, setup.rate_hz, force=options.force)
    if options.poses is not None:
        yield PoseTableOutput(options.poses, setup.skeleton, setup.stations, force=options.force)
    if options.view == "browser":
        page = BrowserOutput(setup, control, options.out or Path())
        if not options.no_browser and not page.open_browser():
            say("No browser was found: open the address in one.")
        yield page
    elif options.view is not None:
        yield ViewerOutput(options.view, setup.skeleton, options.out, force=options.force)
