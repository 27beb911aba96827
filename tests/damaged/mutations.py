"""Damages the content of a file: bytes (cut off, flipped, moved), words (numbers that cannot be, swapped cells), form.

All choices come from one `random.Random`, so that a case can be repeated from its seed, and hypothesis can shrink it.
"""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable
from random import Random
from typing import Any

NUMBERS = (
    "0", "-0", "-1", "1.5", "-3.7", "1e200", "-1e200", "1e400", "1e-320", "nan", "inf", "-inf", "NaN", "Infinity",
    "80000000", "999999", str(2**31), str(2**53 + 1), str(2**63), str(-(2**63) - 1), str(2**64), "9" * 5000, "²", "٣",
    "1_000", "0x1F", "1,5", "true", "null", '"10"', "''", "", "[]", "{}", "[1, 2]", "1e5", "00012", "+7", "--2", "0.5",
    "100", "-5", "1e-9",
)  # fmt: skip
WORDS = (
    "", "x", "../../up", "a b", "[/red]", "\x1b[31m", "\x00", "é", "\u2028", "a" * 300, "merge", "-", "#", "'", '"',
)  # fmt: skip
DEEP = ("[" * 3000, "{" * 500, "[" * 40 + "]" * 40, "a." * 3000, '{"a":' * 2000, "(" * 1000, "<a>" * 3000)
TOKEN = re.compile(r"-?[0-9]+(?:\.[0-9]+)?(?:[eE][-+]?[0-9]+)?|[A-Za-z_]+")

Mutation = Callable[[bytes, Random], bytes]


def mutate(body: bytes, random: Random) -> bytes:
    """Returns the content with one to three kinds of damage; the same state of `random` gives the same result."""
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        body = random.choice(KINDS)(body, random)
    return body


def _truncated(body: bytes, random: Random) -> bytes:
    return body[: random.randint(0, len(body))]


def _flipped(body: bytes, random: Random) -> bytes:
    damaged = bytearray(body)
    for _ in range(random.randint(1, 8) if body else 0):
        damaged[random.randint(0, len(body) - 1)] ^= 1 << random.randint(0, 7)
    return bytes(damaged)


def _other_number(body: bytes, random: Random) -> bytes:
    return _replaced(body, random, NUMBERS)


def _other_word(body: bytes, random: Random) -> bytes:
    return _replaced(body, random, WORDS)


def _deeper(body: bytes, random: Random) -> bytes:
    return _replaced(body, random, DEEP)


def _replaced(body: bytes, random: Random, words: tuple[str, ...]) -> bytes:
    """One number or word of a text becomes another; a text without any gets it at its end."""
    text = body.decode("latin-1")
    found = list(TOKEN.finditer(text))
    word = random.choice(words).encode().decode("latin-1")
    if not found:
        return (text + word).encode("latin-1")
    at = random.choice(found)
    return (text[: at.start()] + word + text[at.end() :]).encode("latin-1")


def _lines(body: bytes, random: Random) -> bytes:
    """Lines are swapped, doubled, removed or joined, or get another end."""
    lines = body.split(b"\n")
    i, j = random.randint(0, len(lines) - 1), random.randint(0, len(lines) - 1)
    kind = random.randint(0, 5)
    if kind == 0:
        lines[i], lines[j] = lines[j], lines[i]
    elif kind == 1:
        lines.insert(i, lines[j])
    elif kind == 2:
        del lines[i]
    elif kind == 3:
        lines[i] = b""
    return random.choice((b"\r\n", b"\r", b" ", b"\x0c\n")).join(lines) if kind == 4 else b"\n".join(lines)


def _json_value(body: bytes, random: Random) -> bytes:
    """One value of a JSON document becomes another kind of value; other content stays."""
    try:
        document = json.loads(body)
    except (ValueError, RecursionError):
        return body
    places = list(_places(document))
    if not places:
        return body
    holder, key = random.choice(places)
    others = (None, True, -1, 1.5, 0, 2**40, 2**70, 1e200, "10", "x", "", [], {}, [1, 2, 3], [[]], {"a": 1}, -5, 1e-9)
    kind = random.randint(0, 3)
    if kind == 0 and isinstance(holder, dict):
        del holder[key]
    elif kind == 1 and isinstance(holder, list):
        holder.append(holder[key])
    else:
        holder[key] = random.choice(others)
    return json.dumps(document).encode()


def _places(value: Any) -> list[tuple[Any, Any]]:
    keys = list(value) if isinstance(value, dict) else range(len(value)) if isinstance(value, list) else ()
    return [place for key in keys for place in [(value, key), *_places(value[key])]]


def _parquet(body: bytes, random: Random) -> bytes:
    """A column of a Parquet table is dropped, becomes text, or has a wrong value; or its metadata is damaged.

    Other content stays.
    """
    if not (body.startswith(b"PAR1") and body.endswith(b"PAR1")):
        return body
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        table = pq.read_table(pa.BufferReader(body))
        k = random.randint(0, table.num_columns - 1)
        name, column, kind = table.column_names[k], table.column(k), random.randint(0, 4)
        if kind == 0:
            table = table.remove_column(k)
        elif kind == 1:
            table = table.set_column(k, name, pa.array([str(v) for v in column.to_pylist()]))
        elif kind == 4:
            facts = dict(table.schema.metadata or {})
            table = table.replace_schema_metadata({key: _json_value(v, random) for key, v in facts.items()})
        else:
            values = column.to_pylist()
            if values:
                wrong = (-1, 1.5, float("nan"), float("inf"), 2**62, 0, None, 1e200)
                values[random.randint(0, len(values) - 1)] = random.choice(wrong)
            table = table.set_column(k, name, pa.array(values))
    except (pa.ArrowException, ValueError, TypeError, OSError, AttributeError):
        return body
    sink = io.BytesIO()
    pq.write_table(table, sink)
    return sink.getvalue()


KINDS: tuple[Mutation, ...] = (
    _truncated, _flipped, _other_number, _other_number, _other_word, _deeper, _lines, _json_value, _parquet,
)  # fmt: skip
