"""`database.ground` and `Windows.query` for one pose at a time, compiled: what a session does in every frame."""

import numpy as np

from harness.core.arrays import Floats, Singles
from harness.core.compiled import compiled

_POSTURE = 52


@compiled
def window(past: Floats) -> Singles:
    """(55 m - 3,) the vector of m configurations (m, 55), newest first."""
    count = len(past)
    out = np.empty((count, _POSTURE + 3), np.float32)
    here = past[0]
    here_yaw = 2.0 * np.arctan2(here[6], here[3])
    cosine, sine = np.cos(here_yaw), np.sin(here_yaw)
    for k in range(count):
        q = past[k]
        x, y = q[0] - here[0], q[1] - here[1]
        turn = 2.0 * np.arctan2(q[6], q[3]) - here_yaw
        out[k, 0] = cosine * x + sine * y
        out[k, 1] = cosine * y - sine * x
        out[k, 2] = turn - 2.0 * np.pi * np.round(turn / (2.0 * np.pi))
        level, lean = np.hypot(q[3], q[6]), np.hypot(q[4], q[5])
        along = 2.0 * np.arctan2(lean, level) / max(level * lean, 1e-30)
        out[k, 3] = q[2]
        out[k, 4] = along * (q[4] * q[3] + q[5] * q[6])
        out[k, 5] = along * (q[5] * q[3] - q[4] * q[6])
        out[k, 6] = 0.0
        for i in range(7, 55):
            out[k, i] = q[i]
    return out.reshape(-1)[3:]


@compiled
def stood(posture: Floats, ground: Floats) -> Floats:
    """The configuration (55,) of a posture (52,) on a ground frame (3,)."""
    out = np.empty(_POSTURE + 3)
    out[:2] = ground[:2]
    out[2] = posture[0]
    angle = np.sqrt(posture[1] ** 2 + posture[2] ** 2 + posture[3] ** 2)
    share = np.sin(0.5 * angle) / angle if angle > 1e-12 else 0.5
    w, x, y, z = np.cos(0.5 * angle), share * posture[1], share * posture[2], share * posture[3]
    c, s = np.cos(0.5 * ground[2]), np.sin(0.5 * ground[2])
    out[3], out[4], out[5], out[6] = c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w
    for i in range(4, _POSTURE):
        out[i + 3] = posture[i]
    return out


@compiled
def stepped(qpos: Floats, step: Floats) -> Floats:
    """The ground frame (3,) a step (3,) away from that of a configuration (55,)."""
    yaw = 2.0 * np.arctan2(qpos[6], qpos[3])
    cosine, sine = np.cos(yaw), np.sin(yaw)
    return np.array(
        [
            qpos[0] + cosine * step[0] - sine * step[1],
            qpos[1] + sine * step[0] + cosine * step[1],
            yaw + step[2],
        ]
    )
