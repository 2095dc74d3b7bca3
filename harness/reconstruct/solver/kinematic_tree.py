"""The body as a tree of hinges, and its forward kinematics, compiled.

The V directions of the tangent space are the root's translation (0 to 2, along world axes), the root's rotation (3 to
5, about its own axes), and one for each hinge. A direction moves only the bodies beyond it. The ancestors of a
direction are those between it and the root; their number is its depth.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from harness.body import Body
from harness.core.arrays import Floats, Ints
from harness.core.compiled import compiled
from harness.core.compiled_rotations import as_tuple, quaternion_product, rotate


class KinematicTree(NamedTuple):
    """B bodies, the root first and parents before children, V = 6 + hinges directions, and S stations."""

    parent: Ints
    """(B,) the parent of each body; that of the root is not used."""
    joint_m: Floats
    """(B, 3) position of each joint in its parent's frame [m]."""
    first_dof: Ints
    """(B + 1,) the first direction of each body; the next entry ends its range."""
    axis: Floats
    """(V, 3) hinge axes in the body's frame; rows 0 to 5, the root's, are not used."""
    dof_body: Ints
    """(V,) the body that each direction moves."""
    depth: Ints
    """(V,) the number of ancestors of each direction."""
    ancestors: Ints
    """(V, D) the ancestors of each direction, the root's first, and at [i, depth[i]] the direction itself."""
    station_body: Ints
    """(S,) the body that carries each station."""
    station_dof: Ints
    """(S,) the outermost direction that moves each station."""
    mount_m: Floats
    """(S, 3) position of each station in the frame of its body [m]."""


class KinematicState(NamedTuple):
    """The body in one configuration, and the residuals of its stations: working arrays of one session.

    Rows of `error`, `squared` and `weight` are the S positions, then the S orientations.
    """

    body_m: Floats
    """(B, 3) positions of the joints in the world [m]."""
    world_from_body: Floats
    """(B, 4) orientations of the bodies."""
    axis: Floats
    """(V, 3) rotation axes in the world; rows 0 to 2 are not used."""
    station_m: Floats
    """(S, 3) positions of the stations in the world [m]."""
    error: Floats
    """(2S, 3) target minus station [m]; rotation vector from station to target [rad]."""
    squared: Floats
    """(2S,) squared lengths of the errors."""
    weight: Floats
    """(2S,) precision, reduced by the robust loss."""
    jacobian: Floats
    """(6, D) of one station at a time: linear (rows 0 to 2) and angular velocity (3 to 5) for each depth."""


def build_tree(body: Body, bones: Sequence[int], mount_m: Floats) -> KinematicTree:
    """The tree of a body with stations on these bones (S,), at `mount_m` (S, 3) in their frames."""
    model, stations = body.model, body.bone_body_ids[np.asarray(bones)]
    dofs = np.array(model.body_dofnum[1:])
    dofs[0] = 6
    depth = np.zeros(model.nv, dtype=np.int64)
    for direction, before in enumerate(model.dof_parentid):
        depth[direction] = depth[before] + 1 if before >= 0 else 0
    ancestors = np.zeros((model.nv, depth.max() + 1), dtype=np.int64)
    for direction, before in enumerate(model.dof_parentid):
        ancestors[direction] = ancestors[before]
        ancestors[direction, depth[direction]] = direction
    station_dof = []
    for station in stations:
        while model.body_dofnum[station] == 0:  # welded to its parent
            station = model.body_parentid[station]
        station_dof.append(model.body_dofadr[station] + model.body_dofnum[station] - 1)
    return KinematicTree(
        parent=np.array(model.body_parentid[1:] - 1, dtype=np.int64),
        joint_m=np.array(model.body_pos[1:]),
        first_dof=np.concatenate([[6], np.cumsum(dofs)]),
        axis=np.concatenate([np.zeros((6, 3)), model.jnt_axis[1:]]),
        dof_body=np.array(model.dof_bodyid - 1, dtype=np.int64),
        depth=depth,
        ancestors=ancestors,
        station_body=stations - 1,
        station_dof=np.array(station_dof, dtype=np.int64),
        mount_m=np.array(mount_m, dtype=float),
    )


def new_state(tree: KinematicTree) -> KinematicState:
    """Zeroed arrays for one session."""
    bodies, directions, stations = len(tree.parent), len(tree.depth), len(tree.station_body)
    return KinematicState(
        body_m=np.zeros((bodies, 3)),
        world_from_body=np.zeros((bodies, 4)),
        axis=np.zeros((directions, 3)),
        station_m=np.zeros((stations, 3)),
        error=np.zeros((2 * stations, 3)),
        squared=np.zeros(2 * stations),
        weight=np.zeros(2 * stations),
        jacobian=np.zeros((6, tree.ancestors.shape[1])),
    )


@compiled
def forward_kinematics(tree: KinematicTree, state: KinematicState, qpos: Floats) -> None:
    """Fill in bodies, axes and stations of `state` for a configuration (V + 1,)."""
    body_m, world_from_body, axis = state.body_m, state.world_from_body, state.axis
    length = np.sqrt(qpos[3] ** 2 + qpos[4] ** 2 + qpos[5] ** 2 + qpos[6] ** 2)
    for i in range(3):
        body_m[0, i] = qpos[i]
    for i in range(4):
        world_from_body[0, i] = qpos[3 + i] / length
    q = as_tuple(world_from_body[0])
    axis[3], axis[4], axis[5] = rotate(q, 1.0, 0.0, 0.0), rotate(q, 0.0, 1.0, 0.0), rotate(q, 0.0, 0.0, 1.0)
    for body in range(1, len(tree.parent)):
        parent, joint = tree.parent[body], tree.joint_m[body]
        q = as_tuple(world_from_body[parent])
        x, y, z = rotate(q, joint[0], joint[1], joint[2])
        body_m[body, 0] = body_m[parent, 0] + x
        body_m[body, 1] = body_m[parent, 1] + y
        body_m[body, 2] = body_m[parent, 2] + z
        for hinge in range(tree.first_dof[body], tree.first_dof[body + 1]):
            local, half = tree.axis[hinge], 0.5 * qpos[hinge + 1]
            axis[hinge, 0], axis[hinge, 1], axis[hinge, 2] = rotate(q, local[0], local[1], local[2])
            sine = np.sin(half)
            q = quaternion_product(q, (np.cos(half), sine * local[0], sine * local[1], sine * local[2]))
        world_from_body[body, 0], world_from_body[body, 1], world_from_body[body, 2], world_from_body[body, 3] = q
    for s in range(len(tree.station_body)):
        body, mount = tree.station_body[s], tree.mount_m[s]
        x, y, z = rotate(as_tuple(world_from_body[body]), mount[0], mount[1], mount[2])
        state.station_m[s] = body_m[body, 0] + x, body_m[body, 1] + y, body_m[body, 2] + z


@compiled
def forward_kinematics_batch(
    tree: KinematicTree, state: KinematicState, qpos: Floats, station_m: Floats, world_from_bone: Floats
) -> None:
    """Fill in station positions (T, S, 3) and orientations of their bones (T, S, 4) for configurations (T, V + 1)."""
    for t in range(len(qpos)):
        forward_kinematics(tree, state, qpos[t])
        station_m[t] = state.station_m
        for s in range(len(tree.station_body)):
            world_from_bone[t, s] = state.world_from_body[tree.station_body[s]]


@compiled
def station_jacobian(tree: KinematicTree, state: KinematicState, station: int) -> None:
    """Fill in `state.jacobian` for every direction that moves a station, by depth.

    Depths 0 to 2 are the root's translation. A rotation about axis a through point p moves the station by a x (s - p).
    """
    jacobian, at, last = state.jacobian, state.station_m[station], tree.station_dof[station]
    jacobian[:, :3] = 0.0
    jacobian[0, 0] = jacobian[1, 1] = jacobian[2, 2] = 1.0
    for d in range(3, tree.depth[last] + 1):
        i = tree.ancestors[last, d]
        a, point = state.axis[i], state.body_m[tree.dof_body[i]]
        x, y, z = at[0] - point[0], at[1] - point[1], at[2] - point[2]
        jacobian[0, d] = a[1] * z - a[2] * y
        jacobian[1, d] = a[2] * x - a[0] * z
        jacobian[2, d] = a[0] * y - a[1] * x
        jacobian[3, d], jacobian[4, d], jacobian[5, d] = a[0], a[1], a[2]
