"""All that came over the line, cut into records and replies by their documented sizes alone (docs/is900.md 5.5, 6)."""

import re
from collections.abc import Mapping

REPLY_SIZES = {
    rb"21S": (54, 55),
    rb"2[1-9A-C]O": tuple(range(7, 100, 2)),
    rb"21l[01]{4}\r": (9,),
    rb"21l[01]{32}": (37,),
    rb"31S": (8,),
    rb"3[1-9A-C]s": (8,),
    rb"3[1-9A-C]p": (7,),
    rb"3[1-9A-C]Q": (6,),
    rb"3[1-9A-C]I": (6, 7),
    rb"31G": (16,),
    rb"31P": (48,),
    rb"31F": (70,),
    rb"2 E\*ERROR\*": tuple(range(40, 125)),
}
"""How a reply begins, and how long it may be with its CR LF."""


def cut(data: bytes, sizes: Mapping[bytes, int]) -> tuple[list[bytes], list[bytes]]:
    """Records and replies, each in order; fails where anything stands between them or is not whole.

    `sizes` are those of records, by station. The last one may be unfinished.
    """
    records, replies = [], []
    at = 0
    while at < len(data):
        if data[at : at + 1] == b"0":
            size = sizes[data[at + 1 : at + 2]] if at + 1 < len(data) else 2
            record = data[at : at + size]
            if len(record) == size:
                assert record[2:3] == b" ", record
                assert record[-1:] in (b" ", b"\n"), (record, data[at + size : at + size + 60])
                records.append(record)
        else:
            end = data.find(b"\r\n", at)
            if end < 0:
                assert len(data) - at < 125, data[at:]
                break
            reply = data[at : end + 2]
            allowed = [lengths for pattern, lengths in REPLY_SIZES.items() if re.match(pattern, reply)]
            assert allowed, (reply, data[max(at - 60, 0) : at])
            assert len(reply) in allowed[0], reply
            replies.append(reply)
            size = len(reply)
        at += size
    return records, replies
