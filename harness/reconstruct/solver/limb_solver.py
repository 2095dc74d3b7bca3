"""Closed-form inverse kinematics of the body, limb by limb (`limb_ik`): Kim et al. 2012, the end of B5.

First the whole body is moved until the station on the pelvis, or else on the chest, has its measured pose. Then each
arm and leg is solved for its outermost measured station. Spine, neck and collar bones stay as predicted, so a second
station on the trunk, such as the head's, keeps its error.
"""

from collections.abc import Sequence

import numpy as np

from harness.body import Body
from harness.core import rotations
from harness.core.arrays import Bools, Floats, Ints
from harness.core.humanoid24 import QPOS_OF_DOF
from harness.reconstruct.solver.ground_frame import anchor_of, on_trunk
from harness.reconstruct.solver.hinge_limits import HingeLimits
from harness.reconstruct.solver.limb_ik import END, LOWER, TWIST, UPPER, Limb, LimbTarget, solve_limb
from harness.reconstruct.solver.residuals import Residuals

_ARM = {"humerus": UPPER, "radius": LOWER, "wrist": TWIST, "hand": END}
_LEG = {"femur": UPPER, "tibia": LOWER, "foot": END}


class LimbSolver:
    """Solver for the four limbs of a body and the stations that they carry."""

    def __init__(self, body: Body, bones: Sequence[str], residuals: Residuals, limits: HingeLimits) -> None:
        self._residuals, self._limbs = residuals, []
        trunk = anchor_of(bones)
        self._trunk = trunk if on_trunk(bones[trunk]) else None
        for side in "lr":
            for levels in (_ARM, _LEG):
                carried = [
                    (levels[bone[1:]], s) for s, bone in enumerate(bones) if bone[0] == side and bone[1:] in levels
                ]
                if carried:
                    self._limbs.append(_LimbStations(body, side, levels, sorted(carried, reverse=True), limits))

    def solve(self, qpos: Floats) -> Floats:
        """The configuration (55,) that fits the readings, from a predicted one (55,) within the limits."""
        residuals, count = self._residuals, len(self._residuals.bones)
        out = np.array(qpos)
        residuals.evaluate(out)
        has_position, has_orientation = residuals.measured[:count], residuals.measured[count:]
        trunk = self._trunk
        if trunk is not None and (has_position[trunk] or has_orientation[trunk]):
            self._move_trunk(out, trunk, bool(has_position[trunk]), bool(has_orientation[trunk]))
            residuals.evaluate(out)
        for limb in self._limbs:
            limb.solve(out, residuals, has_position, has_orientation)
        return out

    def _move_trunk(self, qpos: Floats, station: int, has_position: bool, has_orientation: bool) -> None:
        """Move the root so that this station gets its measured orientation and position.

        Without a position the root turns on the spot: about the station it would drift, frame by frame.
        """
        residuals = self._residuals
        if has_orientation:
            bone = residuals.state.world_from_body[residuals.tree.station_body[station]]
            turn = rotations.multiply(residuals.world_from_target[station], rotations.inverse(bone))
            if has_position:
                pivot_m = residuals.station_m[station]
                qpos[:3] = pivot_m + rotations.rotate(turn, qpos[:3] - pivot_m)
            qpos[3:7] = rotations.multiply(turn, qpos[3:7])
        if has_position:
            qpos[:3] += residuals.target_m[station] - residuals.station_m[station]


class _LimbStations:
    """One limb and its stations, outermost first."""

    def __init__(
        self, body: Body, side: str, levels: dict[str, int], stations: list[tuple[int, int]], limits: HingeLimits
    ) -> None:
        skeleton = body.skeleton
        index = {level: skeleton.index(side + bone) for bone, level in levels.items()}
        ball, hinge, end = (skeleton.axes[skeleton.dof_of_bone[index[level]]] for level in (UPPER, LOWER, END))
        arm = TWIST in index
        twist = skeleton.axes[skeleton.dof_of_bone[index[TWIST]]][0] if arm else np.zeros(3)
        dofs = [*self._dofs(body, index[UPPER]), *self._dofs(body, index[LOWER])]
        dofs += self._dofs(body, index[TWIST]) if arm else [-1]
        dofs += self._dofs(body, index[END])
        self._stations = stations
        """Level and number of each station."""
        self._exists = np.array([dof >= 0 for dof in dofs])
        """(7,) False for the twist of a leg."""
        self._qpos: Ints = 7 + QPOS_OF_DOF[np.maximum(dofs, 0)]
        """(7,) the hinges' places in `qpos`."""
        where = self._qpos - 7
        self._limb = Limb(
            ball=np.array(ball),
            upper_m=np.array(skeleton.bone_m[index[UPPER]]),
            hinge=np.array(hinge[0]),
            lower_m=np.array(skeleton.bone_m[index[LOWER]]),
            twist=np.array(twist),
            twist_m=np.array(skeleton.bone_m[index[TWIST]]) if arm else np.zeros(3),
            end=np.array(end),
            low_rad=np.where(self._exists, limits.low_rad[where], 0.0),
            high_rad=np.where(self._exists, limits.high_rad[where], 0.0),
        )
        self._body = int(body.bone_body_ids[index[UPPER]]) - 1
        self._parent = int(body.bone_body_ids[skeleton.parents[index[UPPER]]]) - 1

    @staticmethod
    def _dofs(body: Body, bone: int) -> list[int]:
        where = body.skeleton.dof_of_bone[bone]
        return list(range(where.start, where.stop))

    def solve(self, qpos: Floats, residuals: Residuals, has_position: Bools, has_orientation: Bools) -> None:
        """Change the limb's hinges in `qpos` for its outermost measured station; `residuals` hold the body's state."""
        state = residuals.state
        for level, station in self._stations:
            if not (has_position[station] or has_orientation[station]):
                continue
            angles = np.where(self._exists, qpos[self._qpos], 0.0)
            target = LimbTarget(
                *(level, residuals.mount_m[station], residuals.target_m[station], residuals.world_from_target[station]),
                *(bool(has_position[station]), bool(has_orientation[station])),
            )
            solve_limb(self._limb, angles, state.world_from_body[self._parent], state.body_m[self._body], target)
            qpos[self._qpos[self._exists]] = angles[self._exists]
            return
