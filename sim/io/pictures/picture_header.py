"""The size that a picture file declares in its header, read before the picture is decoded.

A file of some kilobytes may declare a picture that fills the memory. Known are JPEG, PNG, BMP and TIFF.
"""

from __future__ import annotations

import struct

from scenarios.limits import fits_picture

WIDTH_TAG, HEIGHT_TAG = 256, 257  # of TIFF
FRAME_MARKERS = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}  # of JPEG: those that begin a frame
LONELY_MARKERS = frozenset(range(0xD0, 0xDA)) | {0x01}  # of JPEG: without a length


def declared_size(body: bytes) -> tuple[int, int] | None:
    """Returns (width, height) px by the header of a picture file; None for other or damaged bytes."""
    try:
        if body.startswith(b"\x89PNG\r\n\x1a\n"):
            return struct.unpack(">II", body[16:24])
        if body.startswith(b"\xff\xd8"):
            return _jpeg(body)
        if body.startswith(b"BM"):
            width, height = struct.unpack("<ii", body[18:26])
            return abs(width), abs(height)
        if body[:4] in (b"II*\0", b"MM\0*"):
            return _tiff(body, "<" if body[:2] == b"II" else ">")
    except (struct.error, IndexError):
        return None
    return None


def is_bearable(body: bytes) -> bool:
    """Returns True if the declared size is known and a picture of it may be decoded."""
    size = declared_size(body)
    return size is not None and fits_picture(*size)


def _jpeg(body: bytes) -> tuple[int, int] | None:
    at = 2
    while at + 4 <= len(body):
        if body[at] != 0xFF or body[at + 1] in (0x00, 0xFF):  # fill bytes, or damage that decoders skip
            at += 1
            continue
        marker = body[at + 1]
        if marker in FRAME_MARKERS:
            height, width = struct.unpack(">HH", body[at + 5 : at + 9])
            return width, height
        at += 2 if marker in LONELY_MARKERS else 2 + struct.unpack(">H", body[at + 2 : at + 4])[0]
    return None


def _tiff(body: bytes, order: str) -> tuple[int, int] | None:
    (start,) = struct.unpack(f"{order}I", body[4:8])
    (count,) = struct.unpack(f"{order}H", body[start : start + 2])
    found = {}
    for k in range(count):
        entry = body[start + 2 + 12 * k : start + 14 + 12 * k]
        tag, kind = struct.unpack(f"{order}HH", entry[:4])
        if tag in (WIDTH_TAG, HEIGHT_TAG):
            short = kind == 3
            found[tag] = struct.unpack(f"{order}H" if short else f"{order}I", entry[8 : 10 if short else 12])[0]
    return (found[WIDTH_TAG], found[HEIGHT_TAG]) if len(found) == 2 else None
