"""Faults of single records in a recorded simulation."""

import numpy as np

from harness.stream.codec.reader import ByteCapture
from harness.stream.emulator.faults import Fault, add_byte_faults, unapplied_kinds

RECORDS = [f"record {i:04d}\r\n".encode() for i in range(2000)]
CAPTURE = ByteCapture(
    b"".join(RECORDS), np.cumsum([len(record) for record in RECORDS]), 0.01 * np.arange(2000, dtype=float)
)


def chunks(capture: ByteCapture) -> list[bytes]:
    ends = capture.ends.tolist()
    return [capture.data[begin:end] for begin, end in zip([0, *ends], ends, strict=False)]


def test_repeated_records_are_sent_twice() -> None:
    found = chunks(add_byte_faults(CAPTURE, [Fault("repeated", share=0.05)], 1))
    twice = [one == record + record for one, record in zip(found, RECORDS, strict=True)]
    assert all(one == record or again for one, record, again in zip(found, RECORDS, twice, strict=True))
    assert 70 < sum(twice) < 130


def test_the_seed_decides_and_other_faults_change_nothing() -> None:
    fault = Fault("repeated", share=0.05)
    assert add_byte_faults(CAPTURE, [fault], 1).data == add_byte_faults(CAPTURE, [fault], 1).data
    assert add_byte_faults(CAPTURE, [fault], 1).data != add_byte_faults(CAPTURE, [fault], 2).data
    stall = Fault("stall", at_s=(1.0,), lasts_s=0.5)
    assert add_byte_faults(CAPTURE, [stall], 1) is CAPTURE
    assert unapplied_kinds([fault, stall, Fault("firmware", firmware="4.1105")]) == ["firmware", "stall"]
    assert add_byte_faults(CAPTURE, [fault, stall], 1).data == add_byte_faults(CAPTURE, [fault], 1).data
