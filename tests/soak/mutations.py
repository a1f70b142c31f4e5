"""Sound bytes → damaged ones: bytes, lines, values, JSON trees, and what is inside gzip."""

from __future__ import annotations

import gzip
import json
import random
import re
import struct
from collections.abc import Callable
from typing import Any

NASTY = [
    b"nan", b"inf", b"-inf", b"1e300", b"-1e300", b"1e-320", b"1e999", b"-0", b"0", b"-1", b"1000000000",
    b"99999999999999999999", b"2147483648", b"1e9", b"1e11", b"-3155760000", b"0x10", b"1_0", b"+5", b"1,5",
    "١".encode(), b"", b"\0", b"\xff", b"#", b"NaN", b"true", b"9" * 5000, b"FLASER", b"16384", b"16385",
    b"360", b"1e308", b"-1e308", b"0.0000001", b"\t", b"\r", b"\x85", b"\xe2\x80\xa8",
]  # fmt: skip
"""Tokens that stand for no number, or for one that nobody expects."""
VALUES: list[Any] = [
    None, True, [], {}, "", "x", 0, -1, 1e300, -1e300, 10**30, 2**53, 2**53 + 1, 2**63, 1e-320, 0.5, "nan",
    "1e300", [0] * 6, [[]], "\ud800", "\0",
]  # fmt: skip
WORDS = [0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 2**63 - 1, 2**63,
         2**64 - 1, 16385, 10**9]  # fmt: skip
FLOATS = [float("nan"), float("inf"), -float("inf"), 1e300, -1e30, 1e-45, 0.0]
FACTORS = [0.0, -1.0, 10.0, 1e3, 1e6, 1e-6, 1.001, 1e12]
TOKEN = re.compile(rb"[^\s,\[\]{}:=\"]+")
LARGEST = 400_000
"""Bytes; what grows beyond is cut."""

Chance = random.Random
Mutation = Callable[[bytes, Chance], bytes]


def flip(data: bytes, chance: Chance) -> bytes:
    """One to eight bits flipped."""
    out = bytearray(data)
    for _ in range(chance.randint(1, 8)):
        out[chance.randrange(len(out))] ^= 1 << chance.randrange(8)
    return bytes(out)


def overwrite(data: bytes, chance: Chance) -> bytes:
    """A few bytes in a row set to others."""
    at, size = chance.randrange(len(data)), chance.randint(1, 16)
    return data[:at] + chance.randbytes(size) + data[at + size :]


def cut(data: bytes, chance: Chance) -> bytes:
    """The end lost."""
    return data[: chance.randrange(len(data))]


def drop(data: bytes, chance: Chance) -> bytes:
    """A stretch lost."""
    at = chance.randrange(len(data))
    return data[:at] + data[at + chance.randint(1, 1 + len(data) // 4) :]


def repeat(data: bytes, chance: Chance) -> bytes:
    """A stretch written several times."""
    at = chance.randrange(len(data))
    part = data[at : at + chance.randint(1, 1 + len(data) // 4)]
    return data[:at] + part * chance.randint(2, 20) + data[at:]


def word(data: bytes, chance: Chance) -> bytes:
    """A number of 1, 2, 4 or 8 bytes set to a border value: lengths, counts, offsets."""
    if chance.random() < 0.3:
        packed = struct.pack(chance.choice(["<f", "<d"]), _fitting(chance.choice(FLOATS)))
    else:
        size = chance.choice([1, 2, 4, 8])
        packed = (chance.choice(WORDS) % (1 << 8 * size)).to_bytes(size, chance.choice(["little", "big"]))
    at = chance.randrange(len(data))
    return data[:at] + packed + data[at + len(packed) :]


def _fitting(value: float) -> float:
    return value if abs(value) < 1e38 or value != value or value in (float("inf"), -float("inf")) else 3e38


def token(data: bytes, chance: Chance) -> bytes:
    """One to four values of a text set to nasty ones."""
    for _ in range(chance.randint(1, 4)):
        found = list(TOKEN.finditer(data))
        if not found:
            return data
        place = chance.choice(found)
        data = data[: place.start()] + chance.choice(NASTY) + data[place.end() :]
    return data


def scale(data: bytes, chance: Chance) -> bytes:
    """Some numbers of a text made larger, smaller, zero or negative: all of it can still be read."""
    share, factor = chance.choice([0.001, 0.01, 0.3]), chance.choice(FACTORS)

    def scaled(found: re.Match[bytes]) -> bytes:
        if chance.random() > share:
            return found[0]
        try:
            return repr(float(found[0]) * factor).encode()
        except ValueError:
            return found[0]

    return TOKEN.sub(scaled, data)


def column(data: bytes, chance: Chance) -> bytes:
    """The same value of every line set to a nasty one."""
    at, value = chance.randrange(20), chance.choice(NASTY)
    at = -at - 1 if chance.random() < 0.5 else at
    lines = []
    for line in data.split(b"\n"):
        fields = line.split(b" ")
        if -len(fields) <= at < len(fields):
            fields[at] = value
        lines.append(b" ".join(fields))
    return b"\n".join(lines)


def lines(data: bytes, chance: Chance) -> bytes:
    """Lines lost, doubled, shuffled, joined, or ended in another way."""
    rows = data.split(b"\n")
    kind = chance.randrange(6)
    at = chance.randrange(len(rows))
    if kind == 0:
        del rows[at]
    elif kind == 1:
        rows[at:at] = [rows[at]] * chance.randint(1, 50)
    elif kind == 2:
        chance.shuffle(rows)
    elif kind == 3:
        return b" ".join(rows)
    elif kind == 4:
        return data.replace(b"\n", chance.choice([b"\r\n", b"\r", b"\n\n", b"\0\n", b"\x0b"]))
    else:
        rows[at] = rows[at] + b" " + rows[chance.randrange(len(rows))]
    return b"\n".join(rows)


def tree(data: bytes, chance: Chance) -> bytes:
    """A value of a JSON document replaced, lost or nested deeply; other data as they are."""
    try:
        document = json.loads(data)
    except (ValueError, RecursionError):
        return token(data, chance)
    if chance.random() < 0.05:
        return data.replace(b"[", b"[" * chance.choice([10, 1000, 100_000]), 1)
    for _ in range(chance.randint(1, 3)):
        holder: Any = document
        while True:
            keys = list(holder) if isinstance(holder, dict) else range(len(holder))
            key = chance.choice(list(keys)) if keys else None
            if key is None:
                break
            inner = holder[key]
            if isinstance(inner, (dict, list)) and inner and chance.random() < 0.85:
                holder = inner
                continue
            if isinstance(inner, (int, float)) and chance.random() < 0.5:
                holder[key] = inner * chance.choice(FACTORS)
            elif chance.random() < 0.2:
                del holder[key]
            else:
                holder[key] = chance.choice(VALUES)
            break
    return json.dumps(document).encode()


def inside(data: bytes, chance: Chance) -> bytes:
    """What is in a gzip file damaged, and packed again; other data as they are."""
    try:
        content = gzip.decompress(data)
    except (OSError, EOFError, ValueError):
        return flip(data, chance)
    except Exception:
        return cut(data, chance)
    return gzip.compress(chance.choice(TEXT)(content, chance), 1, mtime=0)


BYTES: list[Mutation] = [flip, overwrite, cut, drop, repeat, word]
TEXT: list[Mutation] = [token, token, scale, scale, column, lines, flip, cut, drop, repeat]


def damaged(data: bytes, form: str, chance: Chance) -> bytes:
    """The data after one to three mutations that fit their form."""
    if form == "gzip":
        kinds = [*BYTES, inside, inside, inside]
    elif form.startswith("recording"):
        kinds = [*BYTES, word, word]
    elif form == "json graph":
        kinds = [tree, tree, tree, tree, scale, scale, *TEXT]
    else:
        kinds = TEXT
    for _ in range(chance.choice([1, 1, 1, 2, 3])):
        if data:
            data = chance.choice(kinds)(data, chance)[:LARGEST]
    return data
