"""VRPN's messages: those of the real server, every split of them, and what is no message."""

import struct
from itertools import pairwise

import pytest

from harness.stream.vrpn.messages import (
    COOKIE,
    MAX_NAMES,
    MAX_PAYLOAD_BYTES,
    SENDER_DESCRIPTION,
    TYPE_DESCRIPTION,
    MalformedMessage,
    MessageReader,
    NameTable,
    PoseReport,
    VrpnMessage,
    decode_name,
    decode_pose,
    encode_description,
)

# From vrpn_server 07.38 (github.com/vrpn/vrpn, commit 893c7496) with `vrpn_Tracker_Spin Tracker0 1 60.0 0 0 1 0.5`: the
# cookie, the descriptions of the sender and of the type of a pose, and a report.
REAL_COOKIE = "7672706e3a207665722e2030372e33382020300000000000"
REAL_SENDER = "000000256b0a13cd00046d2600000001ffffffff0000000100000009547261636b65723000000000"
REAL_TYPE = (
    "000000326b0a13cd00046d2700000004fffffffe00000007000000167672706e5f547261636b657220506f735f5175617400000000000000"
)
REAL_POSE = (
    "000000586b0a13cd0004b0fc000000010000000400000017000000000000000000000000000000000000000000000000000000000000000000"
    "0000000000000000000000000000003fee607524742b783fd41febaa7a2254"
)
HELLO = bytes.fromhex(REAL_COOKIE + REAL_SENDER + REAL_TYPE + REAL_POSE)
SENT_US = 1_000_000 * 0x6B0A13CD + 0x4B0FC
REPORT = PoseReport(3, 1_700_000_000_000_001, (0.1, -2.5, 1e-9), (0.5, -0.5, 0.1, 0.7))


def test_the_hello_of_a_real_server_is_read_whatever_its_pieces() -> None:
    for size in (1, 7, 24, 41, len(HELLO)):
        reader = MessageReader()
        pieces = [HELLO[at : at + size] for at in range(0, len(HELLO), size)]
        sender, kind, pose = [message for piece in pieces for message in reader.feed(piece)]
        assert (sender.type, sender.sender, decode_name(sender)) == (SENDER_DESCRIPTION, 1, "Tracker0")
        assert (kind.type, kind.sender, decode_name(kind)) == (TYPE_DESCRIPTION, 4, "vrpn_Tracker Pos_Quat")
        assert (pose.type, pose.sender, pose.time_us) == (4, 1, SENT_US)
        z, w = struct.unpack(">2d", bytes.fromhex("3fee607524742b783fd41febaa7a2254"))
        assert decode_pose(pose) == PoseReport(0, SENT_US, (0.0, 0.0, 0.0), (w, 0.0, 0.0, z))


def test_messages_are_written_as_a_real_server_writes_them() -> None:
    reader = MessageReader()
    sender, kind, pose = reader.feed(HELLO)
    again = encode_description(SENDER_DESCRIPTION, 1, "Tracker0", sender.time_us)
    assert again.encode(1).hex() == REAL_SENDER
    assert encode_description(TYPE_DESCRIPTION, 4, "vrpn_Tracker Pos_Quat", kind.time_us).encode(7).hex() == REAL_TYPE
    assert decode_pose(pose).encode(4, 1).encode(0x17).hex() == REAL_POSE
    assert len(COOKIE) == 24
    assert COOKIE.startswith(b"vrpn: ver. 07.35  0\0")


def test_a_report_keeps_every_digit() -> None:
    data = REPORT.encode(5, 2).encode()
    assert len(data) == 88
    (message,) = greeted().feed(data)
    assert decode_pose(message) == REPORT
    assert (message.type, message.sender) == (5, 2)


def greeted() -> MessageReader:
    reader = MessageReader()
    assert not list(reader.feed(COOKIE))
    return reader


@pytest.mark.parametrize("length", [0, 23, 24 + MAX_PAYLOAD_BYTES + 1, 0xFFFFFFFF])
def test_a_hostile_length_is_refused_before_its_bytes_arrive(length: int) -> None:
    with pytest.raises(MalformedMessage, match=f"a message of {length:,} bytes"):
        list(greeted().feed(struct.pack(">I", length) + bytes(20)))


def test_the_longest_message_is_read() -> None:
    longest = VrpnMessage(9, 0, 0, bytes(MAX_PAYLOAD_BYTES))
    assert list(greeted().feed(longest.encode())) == [longest]


@pytest.mark.parametrize("start", [b"HTTP/1.1 200 OK", b"vrpn: ver. 05.1", b"\0"])
def test_another_program_is_refused_at_its_first_bytes(start: bytes) -> None:
    with pytest.raises(MalformedMessage, match="it begins with"):
        list(MessageReader().feed(start))


def test_names_of_impossible_lengths_are_refused() -> None:
    good = encode_description(SENDER_DESCRIPTION, 0, "a" * 99, 0)
    assert decode_name(good) == "a" * 99
    for payload in (b"", b"\0\0\0\0", b"\0\0\0\x05abcd", good.payload + b"x", struct.pack(">I", 101) + bytes(101)):
        with pytest.raises(MalformedMessage, match="a name of"):
            decode_name(VrpnMessage(SENDER_DESCRIPTION, 0, 0, payload))


def test_a_pose_of_another_length_or_of_a_negative_sensor_is_refused() -> None:
    message = REPORT.encode(0, 0)
    with pytest.raises(MalformedMessage, match="a pose of 63 bytes, expected 64"):
        decode_pose(VrpnMessage(0, 0, 0, message.payload[:-1]))
    with pytest.raises(MalformedMessage, match="sensor -1"):
        decode_pose(VrpnMessage(0, 0, 0, b"\xff" * 4 + message.payload[4:]))


def test_a_peer_cannot_name_without_end() -> None:
    table = NameTable()
    for number in range(MAX_NAMES):
        table.add(encode_description(SENDER_DESCRIPTION, number, "a", 0))
    table.add(encode_description(SENDER_DESCRIPTION, 0, "b", 0))
    assert (table[0], table[1], table[-7]) == ("b", "a", "")
    with pytest.raises(MalformedMessage, match="2000 names"):
        table.add(encode_description(SENDER_DESCRIPTION, MAX_NAMES, "a", 0))


def test_messages_follow_each_other_at_multiples_of_eight() -> None:
    lengths = [len(VrpnMessage(0, 0, 0, bytes(size)).encode()) for size in range(17)]
    assert lengths[0] == 24
    assert all(length % 8 == 0 for length in lengths)
    assert {after - before for before, after in pairwise(lengths)} == {0, 8}
