"""Random generators keyed by name, never by draw order.

Adding a station or a fault leaves every other draw identical; one worker or sixteen give the same bytes.
"""

import hashlib

import numpy as np


def generator(seed: int, *names: str | int) -> np.random.Generator:
    """The random generator of the part with these names; the same seed and names give the same draws on any machine."""
    key = "\x1f".join([str(int(seed)), *(str(name) for name in names)])
    digest = hashlib.blake2b(key.encode(), digest_size=16).digest()
    return np.random.Generator(np.random.Philox(int.from_bytes(digest, "little")))
