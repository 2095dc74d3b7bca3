"""Audit of the environment variables that a method reads. Python has no event for them; `os.environ` reports them."""

import os
import sys
from collections.abc import Callable
from typing import Any

_PASSED_THROUGH = ("os", "collections", "collections.abc", "_collections_abc", "string", "configparser", __name__)
"""Modules whose functions read a variable for somebody else, such as `os.getenv`; so does `os.path.expandvars`."""
_listeners: list[Callable[[str, str], None]] = []


class _AuditedEnvironment(os._Environ):  # type: ignore[type-arg]  # generic in type stubs alone
    def __getitem__(self, key: Any) -> Any:
        frame: Any = sys._getframe(1)
        while frame.f_back is not None and (
            frame.f_globals.get("__name__") in _PASSED_THROUGH or frame.f_code.co_name == "expandvars"
        ):
            frame = frame.f_back
        for hear in _listeners:
            hear(os.fsdecode(key), frame.f_code.co_filename)
        return super().__getitem__(key)

    def clear(self) -> None:
        for key in list(self):  # without a look at the values
            del self[key]


def audit_environment(hear: Callable[[str, str], None]) -> None:
    """Call `hear` with the name of each variable that is read from now on, and the file of the code that reads it."""
    _listeners.append(hear)
    for environment in (os.environ, getattr(os, "environb", os.environ)):
        environment.__class__ = _AuditedEnvironment
