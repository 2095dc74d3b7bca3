"""Seeded changes of a file's bytes. A change takes the bytes and a generator, and returns other bytes."""

import json
import random
import re
from collections.abc import Callable
from typing import Any

Change = Callable[[bytes, random.Random], bytes]

NUMBERS = (
    *("9" * 400, "9" * 5000, "-" + "9" * 400, "1e308", "-1e308", "1e-320", "1e999", "nan", "NaN", "inf", "-Infinity"),
    *("0", "-0.0", "-1", "-5", "2147483648", "9223372036854775807", "9223372036854775808", "1_000", "0x" + "f" * 300),
)
WORDS = ("", "..", "../..", "/dev/zero", "a/b", "x" * 300, "\u00e9", "\\u0000", "\\ud800", "\\n", "none", "*", "@", "[")
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
_LINE_BYTES = 10_000_000


def flip_bits(data: bytes, rng: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8))):
        if changed:
            changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def set_bytes(data: bytes, rng: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(rng.choice((1, 2, 4))):
        if changed:
            changed[rng.randrange(len(changed))] = rng.choice((0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)))
    return bytes(changed)


def truncate(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def remove_block(data: bytes, rng: random.Random) -> bytes:
    begin, end = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    return data[:begin] + data[end:]


def repeat_block(data: bytes, rng: random.Random) -> bytes:
    begin, end = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    return data[:end] + data[begin:end] * rng.choice((1, 2, 5)) + data[end:]


def insert_bytes(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.choice((b"\0", b"\xff\xfe", b"\r", b"\n", b"#", rng.randbytes(12))) + data[at:]


def change_text_form(data: bytes, rng: random.Random) -> bytes:
    """Another encoding, other line ends, a byte order mark, nothing at all, or a line of 10 MB."""
    way = rng.randrange(12)
    if way == 0:
        at = rng.randrange(len(data) + 1)
        return data[:at] + rng.choice((b"9", b"a", b"[", b" ", b'"')) * _LINE_BYTES + data[at:]
    forms = (
        lambda: data.replace(b"\n", b"\r\n"),
        lambda: data.replace(b"\n", b"\r"),
        lambda: b"\xef\xbb\xbf" + data,
        lambda: data.decode("latin-1").encode("utf-16"),
        lambda: b"",
        lambda: b"\n" * 1000,
    )
    return forms[way % len(forms)]()


def change_number(data: bytes, rng: random.Random) -> bytes:
    places = list(_NUMBER.finditer(data))
    if not places:
        return data
    place = rng.choice(places)
    return data[: place.start()] + rng.choice(NUMBERS).encode() + data[place.end() :]


def change_word(data: bytes, rng: random.Random) -> bytes:
    places = list(re.finditer(rb"[A-Za-z_][\w.]*", data))
    if not places:
        return data
    place = rng.choice(places)
    other = rng.choice((*(word.encode() for word in WORDS), rng.choice(places)[0]))
    return data[: place.start()] + other + data[place.end() :]


def change_lines(data: bytes, rng: random.Random) -> bytes:
    lines = data.split(b"\n")
    here, there = rng.randrange(len(lines)), rng.randrange(len(lines))
    way = rng.randrange(3)
    if way == 0:
        del lines[here]
    elif way == 1:
        lines.insert(there, lines[here])
    else:
        lines[here], lines[there] = lines[there], lines[here]
    return b"\n".join(lines)


BYTES: tuple[Change, ...] = (
    flip_bits,
    set_bytes,
    truncate,
    remove_block,
    repeat_block,
    insert_bytes,
    change_text_form,
)
TEXT: tuple[Change, ...] = (*BYTES, change_number, change_number, change_word, change_word, change_lines)

_VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 2**31, 2**63 - 1, 2**63, 10**399, 1.5, -1e308, 1e308, 5e-324),
    *(float("nan"), float("inf"), "", "x", "..", "../x", "x" * 300, "\0", "a\nb", "\ud800", "1e999", [], {}),
    *([[]], [1, "x", None], {"x": 1}, {"": {}}, [None] * 3),
)


def json_value(rng: random.Random) -> Any:
    """A value that is likely to be of another type than a reader expects."""
    if rng.random() < 0.1:
        value: Any = 1
        for _ in range(rng.choice((40, 60, 400, 900))):
            value = [value] if rng.random() < 0.5 else {"a": value}
        return value
    return rng.choice(_VALUES)


def change_json(data: bytes, rng: random.Random) -> bytes:
    """Another value, a missing, doubled or new entry somewhere in a JSON text."""
    content = json.loads(data)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        content = change_value(content, rng)
    return json.dumps(content, indent=rng.choice((None, 1))).encode()


def change_value(content: Any, rng: random.Random) -> Any:
    """The content with one value changed in place, at a random depth."""
    node: Any = content
    parent: Any = None
    key: Any = None
    while isinstance(node, dict | list) and node and (parent is None or rng.random() < 0.8):
        parent = node
        key = rng.choice(list(node)) if isinstance(node, dict) else rng.randrange(len(node))
        node = node[key]
    if parent is None:
        return json_value(rng)
    way = rng.randrange(6)
    if way == 0:
        del parent[key]
    elif way == 1 and isinstance(parent, list):
        parent.append(node)
    elif way == 1:
        parent[rng.choice(WORDS)] = json_value(rng)
    elif way == 2 and isinstance(node, int | float):
        parent[key] = -node if rng.random() < 0.5 else node * rng.choice((1e6, 1e-6, 0))
    else:
        parent[key] = json_value(rng)
    return content


_TOML_VALUES = (
    *NUMBERS,
    *(f'"{word}"' for word in WORDS),
    *(
        "true",
        "[]",
        "{}",
        "[[]]",
        "[1, 'x']",
        "{ x = 1 }",
        "1979-05-27",
        "07:32:00",
        "1979-05-27T07:32:00Z",
        "'''\n'''",
    ),
    *(
        "[" * 60 + "]" * 60,
        "[" * 2000,
        "{ a = " * 60 + "1" + " }" * 60,
        '"' + "x" * 100_000 + '"',
        ".".join("a" * 9000),
    ),
)


def change_toml(data: bytes, rng: random.Random) -> bytes:
    """Another value of a key, a key of another name, or a table that was not there."""
    lines = data.decode().split("\n")
    keys = [number for number, line in enumerate(lines) if re.match(r"[\w.\"]+ *=", line)]
    if not keys or rng.random() < 0.1:
        lines.insert(rng.randrange(len(lines) + 1), rng.choice(("[a.b]", "[[a]]", "a = 1", "a.b.c = 1", "[motion]")))
        return "\n".join(lines).encode()
    number = rng.choice(keys)
    key = lines[number].split("=")[0]
    if rng.random() < 0.15:
        key = rng.choice((*WORDS, ".".join("a" * 9000), "schema", "vary"))
    lines[number] = f"{key} = {rng.choice(_TOML_VALUES)}"
    return "\n".join(lines).encode(errors="surrogatepass")


TOML: tuple[Change, ...] = (*TEXT, *(change_toml,) * 12)
JSON: tuple[Change, ...] = (*TEXT, *(change_json,) * 12)
