"""`python -m harness` is the command `harness`. `python -P -m harness` never looks into the working folder."""

import sys

if __name__ == "__main__":  # modules that are imported from here on do not come from the working folder
    working_folder = "" if sys.flags.safe_path else sys.path.pop(0)

import os
import signal
import time
from threading import Thread

END_S = 60.0
"""Time within which the program ends after its last line, although a thread of a method may hang [s, choice]."""


def main() -> int:
    """Run the command line. Signals are handled from here on, also while the program starts and while it ends."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # the next imports take a while, and Ctrl-C needs no traceback
    from harness.core.interrupts import hold_interrupts, ignore_interrupts
    from harness.core.standard_streams import repair_streams
    from harness.core.working_folder import leave_relative_folders_out

    with hold_interrupts():
        repair_streams()
        leave_relative_folders_out()
        try:
            code = _run_command_line()
        except SystemExit as ended:  # of argparse
            code = int(ended.code or 0)
        ignore_interrupts()
        Thread(target=_end_in_time, args=(code,), daemon=True).start()
        return code


def _run_command_line() -> int:
    try:
        from harness.cli import main as run
    except Exception as error:  # a broken installation
        from harness.commands.output import describe_ending, print_last

        outcome, _ = describe_ending(sys.argv[1:], error)
        return print_last(f"{outcome.word}\n", outcome)
    return run()


def _end_in_time(code: int) -> None:
    time.sleep(END_S)
    os._exit(code)


if __name__ == "__main__":
    from harness.core.working_folder import leave_working_folder_out

    leave_working_folder_out(working_folder)
    sys.exit(main())
