"""The errors that users see: InputError (wrong input, exit code 2) and WorkError (failed work or check, exit code 1).

Each message is one line: file, place in it, what was found, what was expected, and what the user can do. Text from
files, names and command lines is made safe to print: no control characters, and no endless lines.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import ClassVar, Self

# the parts of an error, and how many characters of each its line shows at most
PARTS = {"file": 400, "place": 200, "got": 200, "expected": 400, "remedy": 400}

KEPT = 10_000  # how many characters of each part an error keeps at most, for `--json`


class FlockscopeError(Exception):
    """An error message for users; `str()` is exactly one line.

    Args:
        file: The file read or written, "" if there is none.
        place: The line, key, row or frame in it, "" if there is none.
        got: What was found there.
        expected: What should be there.
        remedy: What the user can do.
    """

    exit_code: ClassVar[int] = 1

    def __init__(self, *, file: object = "", place: object = "", got: object, expected: object, remedy: str) -> None:
        self.file, self.place = shortened(str(file), KEPT), shortened(str(place), KEPT)
        self.got, self.expected = shortened(str(got), KEPT), shortened(str(expected), KEPT)
        self.remedy = shortened(remedy, KEPT)
        super().__init__(self.line())

    def line(self) -> str:
        """Returns the error as one line: "file: place: got …; expected …; remedy", long parts cut in the middle."""
        file, place, got, expected, remedy = (
            shortened(printable(" ".join(getattr(self, name).split())), longest) for name, longest in PARTS.items()
        )
        where = "".join(f"{part}: " for part in (file, place) if part)
        return f"{where}got {got}; expected {expected}; {remedy}"

    def replaced(self, **parts: object) -> Self:
        """Returns a copy of the error with the given parts replaced, such as `file`."""
        return type(self)(**{**self.as_dict(), **parts})  # type: ignore[arg-type]

    def as_dict(self) -> dict[str, str]:
        """Returns the parts of the error by name, as `--json` prints them."""
        return {name: getattr(self, name) for name in PARTS}

    def __reduce__(self) -> tuple[object, ...]:
        return partial(type(self), **self.as_dict()), ()


class InputError(FlockscopeError):
    """Wrong input or usage: a command that raises it ends with exit code 2."""

    exit_code: ClassVar[int] = 2


class WorkError(FlockscopeError):
    """The work failed, or a check was not passed: a command that raises it ends with exit code 1."""


def reject(wrong: object, file: object, got: object, expected: object, remedy: str, place: object = "") -> None:
    """Raises InputError, with these parts, if `wrong` is true."""
    if wrong:
        raise InputError(file=file, place=place, got=got, expected=expected, remedy=remedy)


@contextmanager
def extra_needed(extra: str, place: str) -> Iterator[None]:
    """Turns an ImportError of the block into an InputError that tells how to install `extra`. place: what needs it."""
    try:
        yield
    except ImportError as error:
        raise InputError(
            place=place, got=f"no package {error.name}", expected=f"the extra [{extra}]",
            remedy=f'pip install "flockscope[{extra}]", or in a clone: pip install -c constraints.txt -e ".[{extra}]"',
        ) from None  # fmt: skip


class OrderError(WorkError):
    """An order of a scenario's script did not come true with one seed; the scenario may work with others."""


# unicode categories that are never printed: control (as ESC), format (as right-to-left marks), surrogates, and
# separators of lines and paragraphs
CONTROL = ("Cc", "Cf", "Cs", "Zl", "Zp")


def printable(text: str, keep: str = "") -> str:
    """Returns the text with each control character, except those in `keep`, replaced by an escape such as "\\x1b"."""
    if text.isprintable():
        return text
    hidden = {c for c in text if not c.isprintable() and c not in keep and is_control(c)}
    return "".join(c.encode("unicode_escape").decode() if c in hidden else c for c in text)


def is_control(character: str) -> bool:
    """Returns True if the character is of a category that is never printed (CONTROL)."""
    return unicodedata.category(character) in CONTROL


def counted(number: int, noun: str, plural: str = "") -> str:
    """Returns a number with its noun: "1 frame", "2 frames". plural: of the noun; "": with an "s"."""
    return f"{number} {noun if number == 1 else plural or noun + 's'}"


def shortened(text: str, longest: int) -> str:
    """Returns the text if it has at most `longest` characters, else as many: its beginning, "…" and its end."""
    if len(text) <= longest:
        return text
    end = longest // 3
    return f"{text[: longest - 1 - end]}…{text[-end:]}"
