"""ezc3d in a process of its own: `python -m harness.mocap.read.ezc3d_process FILE OUT` writes what it read as npz.

ezc3d is C++ that trusts its input: of files with a few damaged bytes in the header about one in 200 crashes it, and
some keep it busy for ever. Neither may take the program along. Exit 3 means that ezc3d is not installed, 4 that it
refused the file, for the reason on stderr; memory is limited where the system can.
"""

import sys
from typing import Any

import numpy as np

MEMORY_LIMIT_BYTES = 4 * 2**30
NO_EZC3D, UNREADABLE = 3, 4
TEXT_PARAMETERS = ("UNITS", "X_SCREEN", "Y_SCREEN")


def main(file: str, out: str) -> int:
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
    """LABELS, LABELS2, LABELS3, ...: 255 labels fit in each."""
    digits = key.removeprefix("LABELS")
    return int(digits) if digits.isdecimal() else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
