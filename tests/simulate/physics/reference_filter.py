"""The filter of one station once more, with dense matrices and without anything of its own code."""

import numpy as np
from scipy.spatial.transform import Rotation

from harness.core.arrays import Floats
from tests.simulate.physics.free_station import EMITTER_M, RANGE_NOISE_M, TICK_HZ

DT, TICKS = 1.0 / TICK_HZ, 5
GRAVITY: Floats = np.array([0.0, 0.0, 9.81])
ABSORPTION, SPEED = 1.3, 331.3 * np.sqrt(1.0 + 20.0 / 273.15)


def cross(v: Floats) -> Floats:
    """The matrix of the cross product with v."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


class ReferenceFilter:
    """Error-state filter with global attitude error, as Sola 2017 describes it."""

    def __init__(
        self, position: Floats, velocity: Floats, attitude: Rotation, covariance: Floats, arms: Floats, noise: Floats
    ) -> None:
        self.position, self.velocity, self.attitude = position, velocity, attitude
        self.bias, self.covariance = np.zeros(6), covariance
        self.arms, self.noise = arms, noise
        self.scale, self.range_scale, self.survey, self.gate = 0.0, 0.0, 0.0, 4.0

    def slot(self, angle: Floats, gain: Floats, ranges: Floats, emitter: int) -> None:
        """Increments (5, 3) and the ranges (2,) of a slot."""
        nodes, turns, forces = [(self.position, self.velocity, self.attitude)], [], []
        transition = np.eye(15)
        for k in range(TICKS):
            turn, push = angle[k] - self.bias[:3] * DT, self.attitude.apply(gain[k] - self.bias[3:] * DT)
            r, tick = self.attitude.as_matrix(), np.eye(15)
            tick[3:6, 6:9], tick[3:6, 12:15], tick[6:9, 9:12] = -cross(push), -r * DT, -r * DT
            half = np.eye(15)
            half[0:3] += 0.5 * DT * (np.eye(15)[3:6] + tick[3:6])
            tick[0:3] = half[0:3]
            transition = tick @ transition
            velocity = self.velocity + push + GRAVITY * DT
            self.position = self.position + 0.5 * DT * (self.velocity + velocity)
            self.velocity, self.attitude = velocity, self.attitude * Rotation.from_rotvec(turn)
            nodes.append((self.position, self.velocity, self.attitude))
            turns.append(turn)
            forces.append(push / DT)
        force, duration = np.mean(forces, axis=0), TICKS * DT
        rate = np.sum(turns, axis=0) / duration
        scale = 0.2 * self.scale**2
        gyro, push, gyro_bias, push_bias = self.noise + scale * np.array(
            [rate @ rate, (force + GRAVITY) @ (force + GRAVITY), 0.0, 9.81**2 * (rate @ rate)]
        )
        blocks = np.zeros((5, 5))
        blocks[0, 0], blocks[1, 1] = push * duration**3 / 3.0, push * duration
        blocks[0, 1] = blocks[1, 0] = push * duration**2 / 2.0
        blocks[2, 2], blocks[3, 3], blocks[4, 4] = gyro * duration, gyro_bias * duration, push_bias * duration
        self.covariance = transition @ self.covariance @ transition.T + np.kron(blocks, np.eye(3))
        error = np.zeros(15)
        for m, measured in enumerate(ranges):
            if np.isnan(measured):
                continue
            ticks = measured / SPEED / DT
            k = int(ticks)
            u = ticks - k
            (p0, v0, r0), (p1, v1, _) = nodes[k], nodes[k + 1]
            place = (2 * u**3 - 3 * u**2 + 1) * p0 + (u**3 - 2 * u**2 + u) * DT * v0
            place = place + (3 * u**2 - 2 * u**3) * p1 + (u**3 - u**2) * DT * v1
            facing = r0 * Rotation.from_rotvec(u * turns[k])
            arm = facing.apply(self.arms[m])
            away = place + arm - EMITTER_M[emitter]
            distance = float(np.linalg.norm(away))
            n, lag = away / distance, (TICKS - ticks) * DT
            row = np.zeros(15)
            row[:3], row[3:6], row[6:9] = n, -lag * n, n @ (-cross(arm) + 0.5 * lag**2 * cross(force))
            cardioid = 0.5 - 0.5 * float(facing.apply([0.0, 0.0, 1.0]) @ n)
            amplitude = n[2] * cardioid / distance * 10.0 ** (-ABSORPTION * (distance - 2.0) / 20.0)
            noise = (RANGE_NOISE_M * np.clip(0.5 / amplitude, 0.5, 4.0)) ** 2
            noise += (self.range_scale * distance) ** 2 + self.survey**2
            innovation = measured - distance - row @ error
            total = row @ self.covariance @ row + noise
            if abs(innovation) > self.gate * np.sqrt(total):
                continue
            gain_column = self.covariance @ row / total
            rest = np.eye(15) - np.outer(gain_column, row)
            self.covariance = rest @ self.covariance @ rest.T + noise * np.outer(gain_column, gain_column)
            error = error + gain_column * innovation
        self.position, self.velocity = self.position + error[:3], self.velocity + error[3:6]
        self.attitude = Rotation.from_rotvec(error[6:9]) * self.attitude
        self.bias = self.bias + error[9:]
        reset = np.eye(15)
        reset[6:9, 6:9] += cross(0.5 * error[6:9])
        self.covariance = reset @ self.covariance @ reset.T
