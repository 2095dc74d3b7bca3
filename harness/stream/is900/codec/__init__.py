"""The bytes of an IS-900: records, commands, replies, and the readings in them."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.stream.is900.codec.capacity import check_emulated_capacity, check_range
    from harness.stream.is900.codec.commands import BINARY, CENTIMETRES, STOP, STREAM, ZERO_CLOCK, station_command
    from harness.stream.is900.codec.decoder import Decoder
    from harness.stream.is900.codec.items import (
        BITS_PER_BYTE,
        SHORT_LIST,
        STANDARD_LIST,
        STATION_CHARACTERS,
        describe_list,
        missing_items,
        position_range_m,
        record_size,
        record_type,
    )
    from harness.stream.is900.codec.reader import ByteCapture, CaptureStream, FrameReader, WireFormat
    from harness.stream.is900.codec.records import (
        RecordFormat,
        RecordValues,
        encode_records,
        format_records,
        from_yaw_pitch_roll_deg,
    )
    from harness.stream.is900.codec.replies import Emitter, parse_reply
    from harness.stream.is900.codec.samples import DeviceSamples, FilterSamples
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "BINARY",
    "BITS_PER_BYTE",
    "CENTIMETRES",
    "SHORT_LIST",
    "STANDARD_LIST",
    "STATION_CHARACTERS",
    "STOP",
    "STREAM",
    "ZERO_CLOCK",
    "ByteCapture",
    "CaptureStream",
    "Decoder",
    "DeviceSamples",
    "Emitter",
    "FilterSamples",
    "FrameReader",
    "RecordFormat",
    "RecordValues",
    "WireFormat",
    "check_emulated_capacity",
    "check_range",
    "describe_list",
    "encode_records",
    "format_records",
    "from_yaw_pitch_roll_deg",
    "missing_items",
    "parse_reply",
    "position_range_m",
    "record_size",
    "record_type",
    "station_command",
]
