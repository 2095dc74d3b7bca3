"""Echoes: sound that one plane of the room reflects, as if from the emitter's mirror image (docs/is900.md 16)."""

import numpy as np

from harness.core.arrays import Floats
from harness.core.compiled import compiled


def mirror_images(planes: Floats, position_m: Floats) -> Floats:
    """(J, P, 3) images of J points in P planes; a plane is its unit normal and its distance from the origin [m]."""
    normal, distance_m = planes[:, :3], planes[:, 3]
    beyond_m = np.sum(position_m[:, None] * normal, axis=-1) - distance_m
    out: Floats = position_m[:, None] - 2.0 * beyond_m[..., None] * normal
    return out


@compiled
def reflection_point(plane: Floats, image_m: Floats, to_m: Floats, out: Floats) -> bool:
    """Where a ray from a mirror image (3,) to a point (3,) passes the plane (4,) [m]; False if it does not."""
    before = plane[0] * image_m[0] + plane[1] * image_m[1] + plane[2] * image_m[2] - plane[3]
    after = plane[0] * to_m[0] + plane[1] * to_m[1] + plane[2] * to_m[2] - plane[3]
    if not before * after < 0.0:
        return False
    share = before / (before - after)
    for axis in range(3):
        out[axis] = image_m[axis] + share * (to_m[axis] - image_m[axis])
    return True
