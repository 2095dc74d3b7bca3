"""The output items of a FASTRAK (docs/device.md, FASTRAK)."""

FASTRAK_LIST = (2, 11, 1)
"""Position, quaternion, CR LF: 33 bytes in binary. The list of a session."""
FASTRAK_ITEMS = frozenset((0, 1, 2, 4, 5, 6, 7, 11, 16, 18, 19, 20))
"""Items that are known. 18 to 20 are the 16-bit format of older firmware; the manual of 2012 reserves them. Item 3, the
movement since the last record, and the extended precision (50 to 66) are left out."""
