"""Text from files, names and command lines, made safe to print: no control characters, and no endless lines."""

from __future__ import annotations

import unicodedata

# unicode categories that are never printed: control (as ESC), format (as right-to-left marks), surrogates, and
# separators of lines and paragraphs
CONTROL = ("Cc", "Cf", "Cs", "Zl", "Zp")


def printable(text: str, keep: str = "") -> str:
    """Returns the text with each control character, but those of `keep`, as an escape that a terminal shows."""
    if text.isprintable():
        return text
    return "".join([c if c.isprintable() or c in keep or not is_control(c) else _escape(c) for c in text])


def is_control(character: str) -> bool:
    """Returns True for a character that is never printed."""
    return unicodedata.category(character) in CONTROL


def _escape(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")


def counted(number: int, noun: str) -> str:
    """Returns a number with its noun: "1 frame", "2 frames"."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def shortened(text: str, longest: int) -> str:
    """Returns the text if it has at most `longest` characters, else its beginning and end around a "…"."""
    if len(text) <= longest:
        return text
    end = longest // 3
    return f"{text[: longest - 1 - end]}…{text[-end:]}"
