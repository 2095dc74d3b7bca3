"""`python -m harness` is the command `harness`. `python -P -m harness` never looks into the working folder."""

import sys

from harness.core.python_process import leave_working_folder_out

if __name__ == "__main__":
    leave_working_folder_out()
    from harness.cli import main

    sys.exit(main())
