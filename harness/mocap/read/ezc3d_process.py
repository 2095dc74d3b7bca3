"""Program that reads a C3D file with ezc3d: `python -P ezc3d_process.py FILE OUT` writes an npz file.

ezc3d is C++ that does not check its input. About one in 200 files with a few damaged bytes in the header crashes it,
and some keep it busy for ever, so it runs in a process of its own. Exit code 3 means that ezc3d is not installed, 4
that it refused the file; the reason is on stderr. Memory is limited where the system supports it.
"""

import sys
from typing import Any

import numpy as np

MEMORY_LIMIT_BYTES = 4 * 2**30
NO_EZC3D, UNREADABLE = 3, 4
TEXT_PARAMETERS = ("UNITS", "X_SCREEN", "Y_SCREEN")


def main(file: str, out: str) -> int:
    """Read `file`, write its arrays to `out`, and return the exit code."""
    try:
        import ezc3d
    except ImportError:
        return NO_EZC3D
    if sys.platform != "win32":
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT_BYTES, MEMORY_LIMIT_BYTES))
    try:
        content = ezc3d.c3d(file)
        point = content["parameters"]["POINT"]
        keys = [key for key in sorted(point, key=_label_order) if key.startswith("LABELS")]
        arrays: dict[str, Any] = {
            key: np.array(point[key]["value"] if key in point else [], dtype=str) for key in TEXT_PARAMETERS
        }
        arrays |= {
            "points": content["data"]["points"][:3],
            "residuals": content["data"]["meta_points"]["residuals"][0],
            "rate_hz": content["header"]["points"]["frame_rate"],
            "labels": np.array([text for key in keys for text in point[key]["value"]], dtype=str),
        }
        np.savez(out, **arrays)
    except (OSError, RuntimeError, ValueError, IndexError, KeyError, TypeError, MemoryError) as error:
        print(f"{type(error).__name__}: {error}", file=sys.stderr)
        return UNREADABLE
    return 0


def _label_order(key: str) -> int:
    """Sort key of LABELS, LABELS2, LABELS3, ..., which hold 255 labels each."""
    digits = key.removeprefix("LABELS")
    return int(digits) if digits.isdecimal() else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
