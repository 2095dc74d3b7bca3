"""Style of movement: in what performers differ beyond their proportions, drawn once for each performer.

Performers p1 to p8 have the neutral style, so that their takes stay what results were measured on. They differ less
than people do. The others differ as the walkers of CMU (docs/motion_generator/README.md): `harness bench performers`
measures both. The standard deviations below were chosen on the clips that docs/notes/constants.toml names.
"""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Style:
    """Properties that all takes of a performer share; the defaults are neutral. A factor of 1 changes nothing."""

    left_handed: bool = False
    variety: float = 1.0
    """Factor of the differences between a performer's own takes: how fast and in what mood he walks."""
    posture: float = 1.0
    """Factor of the constant offsets of back, neck and hands."""
    pace: float = 0.0
    """Added to the relative tempo."""
    size: float = 0.0
    """Added to the relative amplitude."""
    speed: float = 1.0
    """Factor of the walking speed."""
    bend_rad: float = 0.0
    """Added to the forward bend of the back."""
    pelvis_rad: float = 0.0
    """Added to the forward tilt of the pelvis."""
    nod_rad: float = 0.0
    """Added to the downward pitch of the gaze."""
    spread_rad: float = 0.0
    """Added to the angle between a hanging arm and the body."""
    elbow_rad: float = 0.0
    """Added to the flexion of the elbow of a hanging arm."""
    arm_forward_rad: float = 0.0
    """Added to the angle by which a hanging arm is held forward."""
    arm_twist_rad: float = 0.0
    """Added to the inward twist of a hanging arm."""
    pronation_rad: float = 0.0
    """Added to the pronation of the forearms."""
    shoulder_rad: tuple[float, float] = (0.0, 0.0)
    """Added to the lift and the reach of the shoulders."""
    swing: float = 1.0
    """Factor of the swing of the arms in walking and jumping."""
    elbow_swing: float = 1.0
    """Factor of the elbow's share of the swing."""
    uneven: float = 0.0
    """Relative difference between the swings of the dominant and the other arm."""
    swing_lag_rad: float = 0.0
    """Delay of the arms behind the legs, in the phase of the gait cycle."""
    trunk_turn: float = 1.0
    """Factor of the chest's rotation in walking."""
    pelvis_turn: float = 1.0
    """Factor of the pelvis's rotation in walking."""
    pelvis_list: float = 1.0
    """Factor of the pelvis's lateral tilt and of the sway in walking."""
    width: float = 1.0
    """Factor of the distance between the feet."""
    toes_out_rad: float = 0.0
    """Added to the angle by which the feet point outward."""
    knees_out_rad: float = 0.0
    """Added to the angle by which the knees point outward of the feet."""
    crouch: float = 0.0
    """Lowering of the pelvis in every behaviour, as a share of the leg."""
    push: float = 1.0
    """Factor of the pitch of the feet at heel strike and push-off."""
    stance_share: float = 0.0
    """Added to the share of the gait cycle that a foot is on the floor."""
    guard_m: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0))
    """Added to the place of the hands ahead, out and up of the chest in boxing and table tennis [m]."""


def sample_style(rng: np.random.Generator) -> Style:
    """Draw the style of a performer."""

    def normal(std: float) -> float:
        return std * float(np.clip(rng.normal(), -1.6, 1.6))

    def factor(std: float) -> float:
        return float(np.exp(normal(std)))

    swing, elbow_swing = factor(0.65), factor(0.3)
    bent_rad = 0.28 * (swing * elbow_swing - 1.0)  # a long swing needs a bent elbow: it does not stretch past straight
    return Style(
        left_handed=bool(rng.random() < 0.12),
        variety=0.4,
        posture=2.0,
        pace=normal(0.07),
        size=normal(0.10),
        speed=factor(0.07),
        bend_rad=normal(0.06),
        pelvis_rad=normal(0.06),
        nod_rad=normal(0.09),
        spread_rad=float(np.clip(normal(0.12), -0.12, 0.3)),
        elbow_rad=max(normal(0.12), bent_rad, -0.05),
        arm_forward_rad=normal(0.12),
        arm_twist_rad=normal(0.32),
        pronation_rad=normal(0.15),
        shoulder_rad=(normal(0.05), normal(0.05)),
        swing=swing,
        elbow_swing=elbow_swing,
        uneven=normal(0.25),
        swing_lag_rad=normal(0.20),
        trunk_turn=factor(0.5),
        pelvis_turn=factor(0.35),
        pelvis_list=factor(0.35),
        width=factor(0.15),
        toes_out_rad=normal(0.11),
        knees_out_rad=normal(0.08),
        crouch=abs(normal(0.018)),
        push=factor(0.16),
        stance_share=normal(0.012),
        guard_m=(normal(0.035), normal(0.03), normal(0.04)),
    )
