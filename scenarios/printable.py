"""Text from files, names and command lines, made safe to print: no control characters, and no endless lines."""

from __future__ import annotations

import unicodedata

CONTROL = ("Cc", "Cf", "Cs", "Zl", "Zp")
"""Unicode categories that are never printed: control (as ESC), format (as right-to-left marks), surrogates, and
separators of lines and paragraphs."""


def printable(text: str, keep: str = "") -> str:
    r"""Returns the text with each control character as an escape: `\x1b` for ESC, `\u202e` for a right-to-left mark.

    Control characters are those of the Unicode categories Cc, Cf, Cs, Zl and Zp. So a terminal shows the text and obeys
    no part of it. keep: control characters that stay, as the line break in a text of several lines.
    """
    if text.isprintable():
        return text
    return "".join([c if c.isprintable() or c in keep or not is_control(c) else _escape(c) for c in text])


def is_control(character: str) -> bool:
    """Returns True for a control character, one of the Unicode categories Cc, Cf, Cs, Zl and Zp."""
    return unicodedata.category(character) in CONTROL


def _escape(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")


def counted(number: int, noun: str) -> str:
    """Returns a number with its noun: "1 frame", "2 frames", "0 frames". noun: in the singular; it takes an s."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def shortened(text: str, longest: int) -> str:
    """Returns the text if it has at most `longest` characters, else its beginning and end around a "…".

    A shortened text has exactly `longest` characters, at least 3: two thirds of them from the beginning.
    """
    if len(text) <= longest:
        return text
    end = longest // 3
    return f"{text[: longest - 1 - end]}…{text[-end:]}"
