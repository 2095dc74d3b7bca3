"""Random mounts: trackers as they are really strapped on, near their nominal mounts."""

from collections.abc import Sequence
from dataclasses import replace

from harness.body.mounts import Mount
from harness.core.seeds import generator


def perturb_mounts(
    mounts: Sequence[Mount], *, beside_m: float, turned_rad: float, seed: int, session: str
) -> tuple[Mount, ...]:
    """Mounts with normal errors: `beside_m` along each axis [m], and `turned_rad` about each axis [rad].

    Both are standard deviations; half a turn makes the orientation practically uniform. Each station of each session
    has its own random draws.
    """
    return tuple(_perturb_mount(mount, beside_m, turned_rad, seed, session) for mount in mounts)


def _perturb_mount(mount: Mount, beside_m: float, turned_rad: float, seed: int, session: str) -> Mount:
    off = generator(seed, "strapped", session, mount.station).normal(size=6)
    (x, y, z), (a, b, c) = (beside_m * off[:3]).tolist(), (turned_rad * off[3:]).tolist()
    return replace(mount, offset_m=(x, y, z), rotation_rad=(a, b, c))
