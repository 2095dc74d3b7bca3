"""Edited copies of a clip, as somebody would make them who wants a test clip among its own examples."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter1d

from harness.core import rotations
from harness.core.arrays import Floats, Ints
from harness.core.motion import Clip
from harness.core.skeleton import forward_kinematics
from harness.mocap import synthetic


def trimmed(clip: Clip) -> Clip:
    """The clip without its first frame and its last quarter."""
    return take_rows(clip, np.arange(1, 3 * len(clip) // 4))


def resampled(clip: Clip, rate_hz: float) -> Clip:
    """The clip at another rate: positions and angles interpolated linearly, orientations normalised."""
    old_s = np.arange(len(clip)) / clip.rate_hz
    new_s = np.arange(0.0, old_s[-1], 1.0 / rate_hz)

    def at(values: Floats) -> Floats:
        return np.stack([np.interp(new_s, old_s, column) for column in values.T], axis=1)

    world_from_root = at(rotations.continuous(clip.world_from_root))
    return replace(
        clip,
        rate_hz=rate_hz,
        root_m=at(clip.root_m),
        world_from_root=world_from_root / np.linalg.norm(world_from_root, axis=1, keepdims=True),
        angles_rad=at(clip.angles_rad),
    )


def hastened(clip: Clip) -> Clip:
    """Every second frame at the old rate: motion at twice the speed, as an AMC file that names no rate plays it."""
    return take_rows(clip, np.arange(0, len(clip), 2))


def reversed_in_time(clip: Clip) -> Clip:
    return take_rows(clip, np.arange(len(clip))[::-1])


def moved(clip: Clip) -> Clip:
    """The clip at another place and with another heading."""
    turn = rotations.exp(np.array([0.0, 0.0, 2.0]))
    return replace(
        clip,
        root_m=rotations.rotate(turn, clip.root_m) + np.array([3.0, -1.0, 0.1]),
        world_from_root=rotations.multiply(turn, clip.world_from_root),
    )


def mirrored(clip: Clip) -> Clip:
    """The clip with left and right changed, played on the same skeleton."""
    skeleton, flip = clip.skeleton, np.array([1.0, -1.0, 1.0])
    angles_rad = np.empty_like(clip.angles_rad)
    for bone, name in enumerate(skeleton.names):
        swapped = {"l": "r", "r": "l"}.get(name[0], "") + name[1:]
        other = skeleton.names.index(swapped) if swapped in skeleton.names else bone
        # A turn about an axis is seen in a mirror as a turn about the mirrored axis, the other way round.
        for dof, source in zip(
            range(*skeleton.dof_of_bone[bone].indices(len(skeleton.axes))),
            range(*skeleton.dof_of_bone[other].indices(len(skeleton.axes))),
            strict=True,
        ):
            angles_rad[:, dof] = (
                np.sign(-(flip * skeleton.axes[source]) @ skeleton.axes[dof]) * (clip.angles_rad[:, source])
            )
    return replace(
        clip,
        root_m=flip * clip.root_m,
        world_from_root=clip.world_from_root * np.array([1.0, -1.0, 1.0, -1.0]),
        angles_rad=angles_rad,
    )


def noisy(clip: Clip) -> Clip:
    """The clip with noise on all hinges that moves the joints by a millimetre (RMS)."""
    rng = np.random.default_rng(1)
    noise_rad = rng.normal(size=clip.angles_rad.shape)
    few = replace(clip, **{k: getattr(clip, k)[:50] for k in ("root_m", "world_from_root", "angles_rad")})
    at_m = [
        forward_kinematics(c.skeleton, c.root_m, c.world_from_root, c.angles_rad).end_m
        for c in (few, replace(few, angles_rad=few.angles_rad + 1e-3 * noise_rad[:50]))
    ]
    scale = 1e-3 / np.sqrt(np.mean(np.sum((at_m[0] - at_m[1]) ** 2, axis=2)))
    return replace(clip, angles_rad=clip.angles_rad + 1e-3 * scale * noise_rad)


def take_rows(clip: Clip, rows: Ints) -> Clip:
    """The frames `rows` of a clip."""
    return replace(
        clip, root_m=clip.root_m[rows], world_from_root=clip.world_from_root[rows], angles_rad=clip.angles_rad[rows]
    )


COPIES: dict[str, Callable[[Clip], Clip]] = {
    "renamed": lambda clip: clip,
    "less one frame": lambda clip: take_rows(clip, np.arange(1, len(clip))),
    "trimmed": trimmed,
    "60 Hz": lambda clip: resampled(clip, 60.0),
    "100 Hz": lambda clip: resampled(clip, 100.0),
    "30 Hz": lambda clip: resampled(clip, 30.0),
    "twice the speed": hastened,
    "reversed": reversed_in_time,
    "moved": moved,
    "mirrored": mirrored,
    "noisy": noisy,
    "all at once": lambda clip: noisy(moved(mirrored(resampled(trimmed(clip), 60.0)))),
}


def with_smooth_noise(clip: Clip, size_deg: float, correlation_s: float) -> Clip:
    """The clip with noise of this standard deviation on each hinge, smoothed by a Gaussian of this width."""
    rng, edge = np.random.default_rng(2), round(5.0 * correlation_s * clip.rate_hz)
    white = rng.normal(size=(len(clip) + 2 * edge, clip.angles_rad.shape[1]))
    noise = gaussian_filter1d(white, correlation_s * clip.rate_hz, axis=0)[edge : edge + len(clip)]
    return replace(clip, angles_rad=clip.angles_rad + np.deg2rad(size_deg) * noise / noise.std(axis=0))


def rounded(clip: Clip, step_deg: float) -> Clip:
    """The clip with all hinge angles rounded to multiples of a step."""
    step_rad = np.deg2rad(step_deg)
    return replace(clip, angles_rad=step_rad * np.round(clip.angles_rad / step_rad))


def with_amplitude(clip: Clip, share: float) -> Clip:
    """The clip with all hinge angles nearer to their means."""
    mean_rad = clip.angles_rad.mean(axis=0)
    return replace(clip, angles_rad=mean_rad + share * (clip.angles_rad - mean_rad))


def with_scaled_angles(clip: Clip, share: float) -> Clip:
    """The clip with all hinge angles multiplied."""
    return replace(clip, angles_rad=share * clip.angles_rad)


def with_other_legs(clip: Clip) -> Clip:
    """The clip with the legs of the same clip half a take later."""
    skeleton, angles_rad = clip.skeleton, clip.angles_rad.copy()
    legs = [b for b, name in enumerate(skeleton.names) if name[1:] in ("femur", "tibia", "foot", "toes")]
    dofs = [d for bone in legs for d in range(*skeleton.dof_of_bone[bone].indices(len(skeleton.axes)))]
    angles_rad[:, dofs] = np.roll(angles_rad[:, dofs], len(clip) // 2, axis=0)
    return replace(clip, angles_rad=angles_rad)


def in_pieces(clip: Clip, piece_s: float) -> Clip:
    """Pieces of the clip, each followed by as long a rest."""
    size = round(piece_s * clip.rate_hz)
    rows = [
        np.append(np.arange(start, start + size), np.full(size, start + size))
        for start in range(0, len(clip) - size, 2 * size)
    ]
    return take_rows(clip, np.concatenate(rows))


def stretched(clip: Clip, share: float) -> Clip:
    """The clip slower by this share, at its old rate."""
    return replace(resampled(clip, clip.rate_hz * (1.0 + share)), rate_hz=clip.rate_hz)


def with_offset(clip: Clip, bones: tuple[str, ...], offset_deg: float) -> Clip:
    """The clip with a constant added to all hinges of some bones."""
    added_rad, skeleton = np.zeros(clip.angles_rad.shape[1]), clip.skeleton
    for bone in bones:
        added_rad[skeleton.dof_of_bone[skeleton.index(bone)]] = np.deg2rad(offset_deg)
    return replace(clip, angles_rad=clip.angles_rad + added_rad)


def shuffled(clip: Clip, piece_s: float) -> Clip:
    """All pieces of the clip in another order."""
    pieces = np.array_split(np.arange(len(clip)), round(len(clip) / clip.rate_hz / piece_s))
    order = np.random.default_rng(3).permutation(len(pieces))
    return take_rows(clip, np.concatenate([pieces[number] for number in order]))


def with_jitter(clip: Clip) -> Clip:
    """The clip with each frame replaced by itself, the one before or the one after."""
    rows = np.arange(len(clip)) + np.random.default_rng(4).integers(-1, 2, len(clip))
    return take_rows(clip, np.clip(rows, 0, len(clip) - 1))


def smoothed(clip: Clip, width_s: float) -> Clip:
    """The clip with its hinge angles filtered by a Gaussian of this standard deviation."""
    return replace(clip, angles_rad=gaussian_filter1d(clip.angles_rad, width_s * clip.rate_hz, axis=0))


def _other_take(clip: Clip) -> Clip:
    """Another take of the same performer and behaviour, as long as the clip."""
    other = synthetic.generate(clip.behaviour, clip.subject, 4, seed=1, duration_s=len(clip) / clip.rate_hz)
    return take_rows(other, np.minimum(np.arange(len(clip)), len(other) - 1))


def blended(clip: Clip, share: float) -> Clip:
    """The clip with this share of the hinge angles of another take."""
    return replace(clip, angles_rad=(1.0 - share) * clip.angles_rad + share * _other_take(clip).angles_rad)


def hidden(clip: Clip, length_s: float) -> Clip:
    """A part of the clip, rounded to 1 deg, between two halves of another take."""
    other, middle, half = _other_take(clip), len(clip) // 2, round(0.5 * length_s * clip.rate_hz)
    part = rounded(take_rows(clip, np.arange(middle - half, middle + half)), 1.0)
    pieces = take_rows(other, np.arange(middle)), part, take_rows(other, np.arange(middle, len(clip)))
    return replace(
        clip,
        root_m=np.concatenate([piece.root_m for piece in pieces]),
        world_from_root=np.concatenate([piece.world_from_root for piece in pieces]),
        angles_rad=np.concatenate([piece.angles_rad for piece in pieces]),
    )


_ARMS = ("lhumerus", "lradius", "rhumerus", "rradius")

EDITS: dict[str, Callable[[Clip], Clip]] = {
    "1 deg of drift": lambda clip: with_smooth_noise(clip, 1.0, 2.0),
    "1 deg of noise of 0.4 s": lambda clip: with_smooth_noise(clip, 1.0, 0.4),
    "2 deg of noise of 0.4 s": lambda clip: with_smooth_noise(clip, 2.0, 0.4),
    "4 deg of noise of 0.4 s": lambda clip: with_smooth_noise(clip, 4.0, 0.4),
    "1 deg of noise of 0.15 s": lambda clip: with_smooth_noise(clip, 1.0, 0.15),
    "2 deg of noise of 0.15 s": lambda clip: with_smooth_noise(clip, 2.0, 0.15),
    "rounded to 1 deg": lambda clip: rounded(clip, 1.0),
    "rounded to 2 deg": lambda clip: rounded(clip, 2.0),
    "rounded to 4 deg": lambda clip: rounded(clip, 4.0),
    "0.9 of the amplitude": lambda clip: with_amplitude(clip, 0.9),
    "0.7 of the amplitude": lambda clip: with_amplitude(clip, 0.7),
    "angles times 0.95": lambda clip: with_scaled_angles(clip, 0.95),
    "angles times 0.9": lambda clip: with_scaled_angles(clip, 0.9),
    "other legs": with_other_legs,
    "pieces of 0.8 s": lambda clip: in_pieces(clip, 0.8),
    "pieces of 0.5 s": lambda clip: in_pieces(clip, 0.5),
    "mirrored": mirrored,
    "reversed": reversed_in_time,
    "50 Hz": lambda clip: resampled(clip, 50.0),
    "moved and turned": moved,
    "3 % slower": lambda clip: stretched(clip, 0.03),
    "rounded to 1 deg, 1 % slower": lambda clip: stretched(rounded(clip, 1.0), 0.01),
    "rounded to 1 deg, 3 % slower": lambda clip: stretched(rounded(clip, 1.0), 0.03),
    "rounded to 1 deg, reversed": lambda clip: reversed_in_time(rounded(clip, 1.0)),
    "20 deg added to an elbow": lambda clip: with_offset(clip, ("lradius",), 20.0),
    "5 deg added to the arms": lambda clip: with_offset(clip, _ARMS, 5.0),
    "20 deg added to the arms": lambda clip: with_offset(clip, _ARMS, 20.0),
    "pieces of 0.8 s in another order": lambda clip: shuffled(clip, 0.8),
    "0.05 of another take": lambda clip: blended(clip, 0.05),
    "half of another take": lambda clip: blended(clip, 0.5),
    "jitter of a frame": with_jitter,
    "filtered with 0.05 s": lambda clip: smoothed(clip, 0.05),
    "filtered with 0.1 s": lambda clip: smoothed(clip, 0.1),
    "3 s rounded to 1 deg inside another take": lambda clip: hidden(clip, 3.0),
    "0.9 of the amplitude, rounded to 1 deg, 60 Hz, mirrored": lambda clip: mirrored(
        resampled(rounded(with_amplitude(clip, 0.9), 1.0), 60.0)
    ),
}
