"""The bytes of an IS-900: records, commands, replies, and the readings in them."""

from typing import TYPE_CHECKING

from harness.core.door import lazy_names

if TYPE_CHECKING:
    from harness.stream.polhemus.codec.capacity import check_emulated_capacity as check_emulated_capacity
    from harness.stream.polhemus.codec.capacity import check_range as check_range
    from harness.stream.polhemus.codec.commands import BINARY as BINARY
    from harness.stream.polhemus.codec.commands import CENTIMETRES as CENTIMETRES
    from harness.stream.polhemus.codec.commands import STOP as STOP
    from harness.stream.polhemus.codec.commands import STREAM as STREAM
    from harness.stream.polhemus.codec.commands import ZERO_CLOCK as ZERO_CLOCK
    from harness.stream.polhemus.codec.commands import station_command as station_command
    from harness.stream.polhemus.codec.decoder import Decoder as Decoder
    from harness.stream.polhemus.codec.items import BITS_PER_BYTE as BITS_PER_BYTE
    from harness.stream.polhemus.codec.items import MOST_DEVICE_HZ as MOST_DEVICE_HZ
    from harness.stream.polhemus.codec.items import SHORT_LIST as SHORT_LIST
    from harness.stream.polhemus.codec.items import STANDARD_LIST as STANDARD_LIST
    from harness.stream.polhemus.codec.items import STATION_CHARACTERS as STATION_CHARACTERS
    from harness.stream.polhemus.codec.items import describe_list as describe_list
    from harness.stream.polhemus.codec.items import missing_items as missing_items
    from harness.stream.polhemus.codec.items import position_range_m as position_range_m
    from harness.stream.polhemus.codec.items import record_size as record_size
    from harness.stream.polhemus.codec.items import record_type as record_type
    from harness.stream.polhemus.codec.reader import ByteCapture as ByteCapture
    from harness.stream.polhemus.codec.reader import FrameReader as FrameReader
    from harness.stream.polhemus.codec.reader import WireFormat as WireFormat
    from harness.stream.polhemus.codec.records import RecordFormat as RecordFormat
    from harness.stream.polhemus.codec.records import RecordValues as RecordValues
    from harness.stream.polhemus.codec.records import encode_records as encode_records
    from harness.stream.polhemus.codec.records import format_records as format_records
    from harness.stream.polhemus.codec.records import from_yaw_pitch_roll_deg as from_yaw_pitch_roll_deg
    from harness.stream.polhemus.codec.replies import Emitter as Emitter
    from harness.stream.polhemus.codec.replies import parse_reply as parse_reply
    from harness.stream.polhemus.codec.samples import DeviceSamples as DeviceSamples
    from harness.stream.polhemus.codec.samples import FilterSamples as FilterSamples
else:
    __getattr__, __dir__ = lazy_names(__name__)
