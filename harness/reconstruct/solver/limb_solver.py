"""The body put on its trackers limb by limb, in closed form (`limb_ik`): Kim et al. 2012, the end of B5.

First the trunk is moved as a whole until the station on the pelvis, or else on the chest, is where it was measured.
Then each arm and leg is put on its outermost station. Spine, neck and collar bones stay as they were predicted, so a
second station on the trunk, such as the head's, is not met.
"""

from collections.abc import Sequence

import numpy as np

from harness.body.humanoid import Body
from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints
from harness.core.humanoid24 import QPOS_OF_DOF
from harness.reconstruct.features.anchor_frame import anchor_of, on_trunk
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.limb_ik import END, LOWER, TWIST, UPPER, Limb, LimbBase, LimbTarget, solve_limb
from harness.reconstruct.solver.residuals import Residuals

_ARM = {"humerus": UPPER, "radius": LOWER, "wrist": TWIST, "hand": END}
_LEG = {"femur": UPPER, "tibia": LOWER, "foot": END}


class LimbSolver:
    """The four limbs of a body and the stations that they carry."""

    def __init__(self, body: Body, bones: Sequence[str], residuals: Residuals, limits: HingeLimits) -> None:
        self._residuals, self._parts = residuals, []
        trunk = anchor_of(bones)
        self._trunk = trunk if on_trunk(bones[trunk]) else None
        for side in "lr":
            for levels in (_ARM, _LEG):
                worn = [(levels[bone[1:]], s) for s, bone in enumerate(bones) if bone[0] == side and bone[1:] in levels]
                if worn:
                    self._parts.append(_LimbStations(body, side, levels, sorted(worn, reverse=True), limits))

    def solve(self, qpos: Floats) -> Floats:
        """The configuration (55,) moved from one that lies within the limits."""
        residuals, count = self._residuals, len(self._residuals.bones)
        out = np.array(qpos)
        residuals.evaluate(out)
        here, facing = residuals.measured[:count], residuals.measured[count:]
        if self._trunk is not None and (here[self._trunk] or facing[self._trunk]):
            self._move_trunk(out, self._trunk, bool(here[self._trunk]), bool(facing[self._trunk]))
            residuals.evaluate(out)
        at_m, turned = residuals.state.body_m, residuals.state.world_from_body
        for part in self._parts:
            part.solve(out, at_m, turned, residuals, here, facing)
        return out

    def _move_trunk(self, qpos: Floats, station: int, here: bool, facing: bool) -> None:
        residuals = self._residuals
        if facing:
            bone = residuals.state.world_from_body[residuals.tree.station_body[station]]
            turn = rotations.multiply(residuals.world_from_target[station], rotations.inverse(bone))
            about_m = residuals.station_m[station]
            qpos[:3] = about_m + rotations.rotate(turn, qpos[:3] - about_m)
            qpos[3:7] = rotations.multiply(turn, qpos[3:7])
        if here:
            qpos[:3] += residuals.target_m[station] - residuals.station_m[station]


class _LimbStations:
    """One limb with its stations, outermost first."""

    def __init__(
        self, body: Body, side: str, levels: dict[str, int], worn: list[tuple[int, int]], limits: HingeLimits
    ) -> None:
        own, names = body.skeleton, {level: side + bone for bone, level in levels.items()}
        index = {level: own.index(name) for level, name in names.items()}
        ball, hinge, end = (own.axes[own.dof_of_bone[index[level]]] for level in (UPPER, LOWER, END))
        arm = TWIST in index
        twist = own.axes[own.dof_of_bone[index[TWIST]]][0] if arm else np.zeros(3)
        dofs = [*self._dofs(body, index[UPPER]), *self._dofs(body, index[LOWER])]
        dofs += self._dofs(body, index[TWIST]) if arm else [-1]
        dofs += self._dofs(body, index[END])
        self._stations = worn
        self._known = np.array([dof >= 0 for dof in dofs])
        self._qpos: Ints = 7 + QPOS_OF_DOF[np.maximum(dofs, 0)]
        where = self._qpos - 7
        self._limb = Limb(
            ball=np.array(ball),
            upper_m=np.array(own.bone_m[index[UPPER]]),
            hinge=np.array(hinge[0]),
            lower_m=np.array(own.bone_m[index[LOWER]]),
            twist=np.array(twist),
            twist_m=np.array(own.bone_m[index[TWIST]]) if arm else np.zeros(3),
            end=np.array(end),
            low_rad=np.where(self._known, limits.low_rad[where], 0.0),
            high_rad=np.where(self._known, limits.high_rad[where], 0.0),
        )
        self._body = int(body.bone_body_ids[index[UPPER]]) - 1
        self._parent = int(body.bone_body_ids[own.parents[index[UPPER]]]) - 1

    @staticmethod
    def _dofs(body: Body, bone: int) -> list[int]:
        where = body.skeleton.dof_of_bone[bone]
        return list(range(where.start, where.stop))

    def solve(
        self, qpos: Floats, at_m: Floats, turned: Floats, residuals: Residuals, here: Bools, facing: Bools
    ) -> None:
        for level, station in self._stations:
            if not (here[station] or facing[station]):
                continue
            angles = np.where(self._known, qpos[self._qpos], 0.0)
            aim = LimbTarget(
                level,
                residuals.mount_m[station],
                residuals.target_m[station],
                residuals.world_from_target[station],
                bool(here[station]),
                bool(facing[station]),
            )
            solve_limb(self._limb, angles, LimbBase(turned[self._parent], at_m[self._body]), aim)
            qpos[self._qpos[self._known]] = angles[self._known]
            return
