"""A program that runs pytest with a limit on memory, since a mutation may allocate without end."""

import resource
import sys

import pytest

MOST_BYTES = 12 * 2**30
"""Private writable memory."""

if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_DATA, (MOST_BYTES, MOST_BYTES))
    sys.exit(pytest.main(sys.argv[1:]))
