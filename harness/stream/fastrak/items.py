"""The output items of a FASTRAK (docs/device.md, FASTRAK)."""

from harness.stream.polhemus.codec.items import EXTENDED_ITEMS

FASTRAK_LIST = (2, 11, 1)
"""Position, quaternion, CR LF: 33 bytes in binary. The list of a session."""
FASTRAK_ITEMS = frozenset((0, 1, 2, 4, 5, 6, 7, 11, 16, 18, 19, 20)) | EXTENDED_ITEMS
"""Items that are known. 18 to 20 are the 16-bit format of older firmware; the manual of 2012 reserves them. Items 3 and
53, the movement since the last record, are left out."""
