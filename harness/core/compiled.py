"""Functions compiled to machine code at their first call, and kept on disk between runs.

For loops over stations and joints, where a call of numpy costs more than the numbers it works on. What is compiled
sees numbers, arrays and named tuples of them, and only compiled functions of its own file: a kept one is made anew
when its file changes, not when another does.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])


def compiled(function: F) -> F:
    """The same function, fast; IEEE arithmetic in the order written, so that the bytes stay the same.

    Other threads go on meanwhile: one that reads a tracker need not wait for one that solves.
    """
    try:
        return cast(F, numba.njit(cache=True, error_model="numpy", nogil=True)(function))
    except RuntimeError:  # nowhere to keep it: neither beside its file nor in a cache of the user's
        return cast(F, numba.njit(error_model="numpy", nogil=True)(function))


def specialise(function: F, *arguments: Any) -> F:
    """A compiled function for arguments of the very types of these, for loops that give it the same arrays.

    Finding out what it is given takes a compiled function longer than many a small task does. This one does not look:
    given anything else, it reads nonsense.
    """
    return cast(F, cast(Any, function).compile(tuple(map(numba.typeof, arguments))))
