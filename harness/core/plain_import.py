"""Imports of libraries with their own defaults, whatever the working folder and the environment hold.

On import MuJoCo loads the renderer that MUJOCO_GL names, which the harness never uses. matplotlib reads a
`matplotlibrc` and numba a `.numba_config.yaml` of the working folder. Such a file or variable would change pages, or
end every verb.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager

_ENVIRONMENT = {
    "MATPLOTLIBRC": os.devnull,  # an empty file of settings
    "MPLBACKEND": "agg",
    "MUJOCO_GL": "disable",
}
WORKING_FOLDER_FILES = ("matplotlibrc", ".numba_config.yaml")
"""Files of settings that libraries look for in the working folder."""


@contextmanager
def plain_import() -> Iterator[None]:
    """Libraries that are first imported in the block have their default settings and read none of a folder.

    The environment is as before afterwards. A variable such as NUMBA_NUM_THREADS, which no library reads on import
    alone, counts as ever.
    """
    before = {name: os.environ.get(name) for name in _ENVIRONMENT}
    exists = os.path.exists
    os.environ.update(_ENVIRONMENT)
    vars(os.path)["exists"] = lambda path: path not in WORKING_FOLDER_FILES and exists(path)
    try:
        yield
    finally:
        vars(os.path)["exists"] = exists
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
