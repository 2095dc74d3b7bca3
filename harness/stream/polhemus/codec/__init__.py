"""The bytes of an IS-900: records, commands, replies, and the readings in them."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.stream.polhemus.codec.capacity import check_emulated_capacity, check_range
    from harness.stream.polhemus.codec.commands import BINARY, CENTIMETRES, STOP, STREAM, ZERO_CLOCK, station_command
    from harness.stream.polhemus.codec.decoder import Decoder
    from harness.stream.polhemus.codec.items import (
        BITS_PER_BYTE,
        MOST_DEVICE_HZ,
        SHORT_LIST,
        STANDARD_LIST,
        STATION_CHARACTERS,
        describe_list,
        missing_items,
        position_range_m,
        record_size,
        record_type,
    )
    from harness.stream.polhemus.codec.reader import ByteCapture, CaptureStream, FrameReader, WireFormat
    from harness.stream.polhemus.codec.records import (
        RecordFormat,
        RecordValues,
        encode_records,
        format_records,
        from_yaw_pitch_roll_deg,
    )
    from harness.stream.polhemus.codec.replies import Emitter, parse_reply
    from harness.stream.polhemus.codec.samples import DeviceSamples, FilterSamples
else:
    __getattr__, __dir__ = lazy_names(__name__)

__all__ = [
    "BINARY",
    "BITS_PER_BYTE",
    "CENTIMETRES",
    "MOST_DEVICE_HZ",
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
