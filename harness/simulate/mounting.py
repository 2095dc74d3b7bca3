"""Trackers as they were really strapped on: near their nominal mounts, in whatever orientation."""

from collections.abc import Sequence
from dataclasses import replace

from harness.body.mounts import Mount
from harness.core.seeds import generator


def perturb_mounts(
    mounts: Sequence[Mount], *, beside_m: float, turned_rad: float, seed: int, session: str
) -> tuple[Mount, ...]:
    """The mounts with each tracker off its place by N(0, `beside_m`) along each of its axes and turned by
    N(0, `turned_rad`) about each; of half a turn, hardly anything is left of the nominal orientation.

    Each station of each session draws for itself.
    """
    return tuple(_perturb_mount(mount, beside_m, turned_rad, seed, session) for mount in mounts)


def _perturb_mount(mount: Mount, beside_m: float, turned_rad: float, seed: int, session: str) -> Mount:
    off = generator(seed, "strapped", session, mount.station).normal(size=6)
    (x, y, z), (a, b, c) = (beside_m * off[:3]).tolist(), (turned_rad * off[3:]).tolist()
    return replace(mount, offset_m=(x, y, z), rotation_rad=(a, b, c))
