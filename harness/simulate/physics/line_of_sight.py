"""Line of sight: which straight paths of sound the performer's body and the furniture block."""

import numpy as np

from harness.body import Body, body_spec
from harness.core import rotations
from harness.core.arrays import Bools, Floats
from harness.core.compiled import compiled
from harness.core.working_folder import plain_import
from harness.simulate.physics.room import PlacedRoom

with plain_import():
    import mujoco

_TISSUE_MARGIN_M = 0.02
"""A surface closer to the end of a path than this does not block it [m] [choice]. Soft tissue or a misplaced mount may
bring a microphone below the rigid surface of the model, where real skin would give way."""


class LineOfSight:
    """Casts rays in a room with one performer, or with none. Paths are in the tracker's frame."""

    def __init__(self, body: Body | None, placed: PlacedRoom) -> None:
        spec = mujoco.MjSpec() if body is None else body_spec(body.skeleton)
        self._world_from_tracker = rotations.to_matrix(placed.world_from_tracker)
        self._origin_m = np.array(placed.origin_m)
        self._model = ray_model(spec, placed)
        self._data = mujoco.MjData(self._model)
        mujoco.mj_kinematics(self._model, self._data)

    def pose_body(self, qpos: Floats) -> None:
        """Put the performer into a configuration (55,)."""
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)

    def occlusion(self, from_m: Floats, to_m: Floats) -> Bools:
        """(N,) whether something lies between a point (3,) and each of N points (N, 3) [m]."""
        start_m, rays, length_m = _rays(self._world_from_tracker, self._origin_m, from_m, to_m)
        count = len(to_m)
        # `mj_multiRay` returns distances in units of each ray's length, and -1 where nothing is hit.
        geom, share = np.empty(count, dtype=np.int32), np.empty(count)
        mujoco.mj_multiRay(
            self._model, self._data, start_m, rays, None, True, -1, geom, share, None, count, mujoco.mjMAXVAL
        )
        out: Bools = (share >= 0.0) & (share * length_m < length_m - _TISSUE_MARGIN_M)
        return out


@compiled
def _rays(turn: Floats, origin_m: Floats, from_m: Floats, to_m: Floats) -> tuple[Floats, Floats, Floats]:
    """In world axes: the start (3,), the rays one after another (3N,), and their lengths (N,) [m]."""
    start_m, rays, length_m = np.empty(3), np.empty(3 * len(to_m)), np.empty(len(to_m))
    for axis in range(3):
        start_m[axis] = origin_m[axis]
        for k in range(3):
            start_m[axis] += turn[axis, k] * from_m[k]
    for ray in range(len(to_m)):
        squared = 0.0
        for axis in range(3):
            along = 0.0
            for k in range(3):
                along += turn[axis, k] * (to_m[ray, k] - from_m[k])
            rays[3 * ray + axis] = along
            squared += along * along
        length_m[ray] = np.sqrt(squared)
    return start_m, rays, length_m


def ray_model(spec: mujoco.MjSpec, placed: PlacedRoom) -> mujoco.MjModel:
    """Compile a body and the furniture for rays; the spec is changed.

    The floor is taken out. `mj_multiRay` looks only at geoms that may collide, so that every geom gets a contact flag.
    """
    if (floor := spec.geom("floor")) is not None:
        spec.delete(floor)
    for geom in spec.geoms:
        geom.contype = 1
    for box in placed.room.furniture:
        x, y, z = box.centre_m
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[placed.centre_m[0] + x, placed.centre_m[1] + y, z],
            size=[length_m / 2 for length_m in box.size_m],
            contype=1,
        )
    return spec.compile()
