"""Faults of single records in a simulated line that is recorded and not played."""

from collections.abc import Sequence

import numpy as np

from harness.stream.codec.capture import ByteCapture
from harness.stream.emulator.faults import BYTE_FAULT_KINDS, Fault, FaultInjector


def add_byte_faults(capture: ByteCapture, faults: Sequence[Fault], seed: int) -> ByteCapture:
    """The capture, one record a chunk, with the faults that change single records, drawn as an emulator draws them."""
    kept = [fault for fault in faults if fault.kind in BYTE_FAULT_KINDS]
    if not kept or not len(capture.ends):
        return capture
    times_s = capture.received_s.tolist()
    injector = FaultInjector(kept, seed, times_s[0])
    ends = capture.ends.tolist()
    chunks = [
        injector.corrupt(capture.data[begin:end], False, now_s)[0]
        for begin, end, now_s in zip([0, *ends], ends, times_s, strict=False)
    ]
    sizes = np.array([len(chunk) for chunk in chunks], dtype=np.int64)
    return ByteCapture(b"".join(chunks), np.cumsum(sizes), capture.received_s)


def unapplied_kinds(faults: Sequence[Fault]) -> list[str]:
    """Kinds of the faults that a capture without a line cannot have."""
    return sorted({fault.kind for fault in faults if fault.kind not in BYTE_FAULT_KINDS})
