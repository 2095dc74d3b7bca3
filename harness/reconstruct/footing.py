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


@compiled
def readings(position_m: Floats, turned: Floats, ground: Floats, lever_m: float) -> Singles:
    """(9 S,) the columns of `controls` for positions (S, 3) and orientations (S, 4), from a ground frame (3,)."""
    cosine, sine = np.cos(ground[2]), np.sin(ground[2])
    out = np.empty((len(position_m), 9), np.float32)
    for k in range(len(position_m)):
        x, y = position_m[k, 0] - ground[0], position_m[k, 1] - ground[1]
        out[k, 0], out[k, 1] = cosine * x + sine * y, cosine * y - sine * x
        out[k, 2] = position_m[k, 2]
        a, b, c, d = turned[k, 0], turned[k, 1], turned[k, 2], turned[k, 3]
        forward = 1.0 - 2.0 * (c * c + d * d), 2.0 * (b * c + a * d), 2.0 * (b * d - a * c)
        left = 2.0 * (b * c - a * d), 1.0 - 2.0 * (b * b + d * d), 2.0 * (c * d + a * b)
        out[k, 3], out[k, 4] = (
            lever_m * (cosine * forward[0] + sine * forward[1]),
            lever_m * (cosine * left[0] + sine * left[1]),
        )
        out[k, 5], out[k, 6] = (
            lever_m * (cosine * forward[1] - sine * forward[0]),
            lever_m * (cosine * left[1] - sine * left[0]),
        )
        out[k, 7], out[k, 8] = lever_m * forward[2], lever_m * left[2]
    return out.reshape(-1)
