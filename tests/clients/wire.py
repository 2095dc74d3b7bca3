"""Splitting of received bytes into records and replies by their documented sizes alone (docs/is900.md 5.5, 6)."""

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
"""Possible lengths of a reply, CR LF included, by its beginning."""


def split_records_and_replies(data: bytes, sizes: Mapping[bytes, int]) -> tuple[list[bytes], list[bytes]]:
    """Split bytes into records and replies; fail where other bytes stand between them or one is incomplete.

    `sizes` are the lengths of records, by station. The last record or reply may be unfinished.
    """
    records, replies = [], []
    offset = 0
    while offset < len(data):
        if data[offset : offset + 1] == b"0":
            size = sizes[data[offset + 1 : offset + 2]] if offset + 1 < len(data) else 2
            record = data[offset : offset + size]
            if len(record) == size:
                assert record[2:3] == b" ", record
                assert record[-1:] in (b" ", b"\n"), (record, data[offset + size : offset + size + 60])
                records.append(record)
        else:
            end = data.find(b"\r\n", offset)
            if end < 0:
                assert len(data) - offset < 125, data[offset:]
                break
            reply = data[offset : end + 2]
            allowed_sizes = [lengths for pattern, lengths in REPLY_SIZES.items() if re.match(pattern, reply)]
            assert allowed_sizes, (reply, data[max(offset - 60, 0) : offset])
            assert len(reply) in allowed_sizes[0], reply
            replies.append(reply)
            size = len(reply)
        offset += size
    return records, replies
