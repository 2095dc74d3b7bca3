"""Children that are to be interrupted."""

import signal


def heeding_interrupts() -> None:
    """For `preexec_fn`: as from a terminal. What a shell starts in the background ignores interrupts, and so would
    its children."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
