"""What a method's process is sent and what it answers, as messages of numbers and texts (see `core.messages`)."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from harness.body import Body, Mount, build_body
from harness.core.arrays import immutable
from harness.core.calibration import Calibration
from harness.core.estimate import HINGE_COUNT, QPOS_SIZE, check_sigma, find_impossible_pose, session_lag
from harness.core.humanoid24 import standard_skeleton
from harness.core.messages import MessageError
from harness.core.motion import BodyMotion
from harness.core.skeleton import Skeleton
from harness.experiment.methods.method_run import MethodAnswers
from harness.stream import TrackerFrame

Message = tuple[dict[str, Any], dict[str, NDArray[Any]]]
Header = Mapping[str, Any]
Arrays = Mapping[str, NDArray[Any]]

_TAKE_TEXTS = ("name", "subject", "source", "behaviour", "rate_hz")
_FRAME_ARRAYS = ("measured_s", "position_m", "tracker_from_station", "quality")
_FRAME_FLAGS = ("position_valid", "orientation_valid", "suspect")
_CALIBRATION_ARRAYS = ("mount_m", "bone_from_station", "world_from_tracker", "tracker_origin_m")
MAX_TEXT = 20_000
"""Longest text that is taken from a method's process, such as a traceback [characters]."""


def encode_training(body: Body, examples: Sequence[BodyMotion], rng: np.random.Generator) -> Message:
    """Everything that `Method.fit` receives."""
    takes = [{name: getattr(take, name) for name in _TAKE_TEXTS} for take in examples]
    mounts = [asdict(mount) for mount in body.mounts]
    arrays = {f"take {number}": take.qpos for number, take in enumerate(examples)}
    skeleton = {"bone_m": body.skeleton.bone_m, "axes": body.skeleton.axes}
    return {"takes": takes, "mounts": mounts, "rng": rng.bit_generator.state}, {**arrays, **skeleton}


def decode_training(header: Header, arrays: Arrays) -> tuple[Body, list[BodyMotion], np.random.Generator]:
    """The arguments of `Method.fit`, which share nothing with those of another method."""
    standard = standard_skeleton()
    skeleton = Skeleton(standard.names, standard.parents, arrays["bone_m"], standard.hinges, arrays["axes"])
    body = build_body(skeleton, [_decode_mount(values) for values in header["mounts"]])
    examples = [BodyMotion(**take, qpos=arrays[f"take {number}"]) for number, take in enumerate(header["takes"])]
    state: Any = header["rng"]
    words = {name: np.array(value, np.uint64) for name, value in state["state"].items()}
    bits = np.random.Philox()
    whole: Any = {**state, "state": words, "buffer": np.array(state["buffer"], np.uint64)}
    bits.state = whole
    return body, examples, np.random.Generator(bits)


def _decode_mount(values: Mapping[str, Any]) -> Mount:
    fields: dict[str, Any] = {name: tuple(v) if isinstance(v, list) else v for name, v in values.items()}
    return Mount(**fields)


def encode_take(calibration: Calibration, frames: Sequence[TrackerFrame]) -> Message:
    """A calibration and the F frames of a take."""
    header = {name: getattr(calibration, name) for name in ("kind", "stations", "bones")}
    arrays = {name: getattr(calibration, name) for name in _CALIBRATION_ARRAYS}
    stations = len(calibration.stations)
    for name in (*_FRAME_ARRAYS, *_FRAME_FLAGS):
        size = {"position_m": (3,), "tracker_from_station": (4,)}.get(name, ())
        stacked = np.array([getattr(frame, name) for frame in frames])
        arrays[name] = stacked.reshape(len(frames), stations, *size)
    arrays["received_s"] = np.array([frame.received_s for frame in frames])
    return header, arrays


def decode_take(header: Header, arrays: Arrays) -> tuple[Calibration, list[TrackerFrame]]:
    """The calibration and the frames that a session of a method receives."""
    fixed = [arrays[name] for name in _CALIBRATION_ARRAYS]
    calibration = Calibration(header["kind"], tuple(header["stations"]), tuple(header["bones"]), *fixed)
    rows = {name: arrays[name] for name in (*_FRAME_ARRAYS, *_FRAME_FLAGS)}
    return calibration, [
        TrackerFrame(received_s=float(received_s), **{name: array[index] for name, array in rows.items()})
        for index, received_s in enumerate(arrays["received_s"])
    ]


def encode_answers(answers: MethodAnswers) -> dict[str, NDArray[Any]]:
    """The arrays of the answers to a take; standard deviations only if the method gives them."""
    return {name: array for name, array in answers._asdict().items() if array is not None}


def decode_answers(arrays: Arrays, frames: int) -> MethodAnswers:
    """The answers of a method's process to so many frames; MessageError when they are anything else."""
    sizes: dict[str, tuple[int, ...]] = dict.fromkeys(MethodAnswers._fields, (frames,))
    sizes |= {"qpos": (frames, QPOS_SIZE), "angle_sigma_rad": (frames, HINGE_COUNT)}
    if "angle_sigma_rad" not in arrays:
        del sizes["angle_sigma_rad"]
    if {name: array.shape for name, array in arrays.items()} != sizes:
        raise MessageError("arrays of another size")
    kinds = {name: np.int64 if name in ("status", "origin", "lag") else np.float64 for name in sizes}
    if any(arrays[name].dtype != kind for name, kind in kinds.items()):
        raise MessageError("arrays of another type")
    if not (np.isin(arrays["status"], (0, 1, 2)).all() and np.isin(arrays["origin"], (0, 1, 2)).all()):
        raise MessageError("an unknown status or origin")
    if fault := find_impossible_pose(arrays["qpos"]):
        raise MessageError(fault)
    try:
        session_lag(arrays["lag"])
        if "angle_sigma_rad" in arrays:
            check_sigma(arrays["angle_sigma_rad"])
    except ValueError as error:
        raise MessageError(str(error)) from error
    return MethodAnswers(**{name: immutable(arrays[name], kind) for name, kind in kinds.items()})


def answers_size(frames: int) -> int:
    """Largest size of a message of answers to so many frames [bytes]."""
    return 8 * frames * (QPOS_SIZE + HINGE_COUNT + len(MethodAnswers._fields)) + MAX_TEXT * 8
