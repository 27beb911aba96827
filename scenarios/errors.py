"""The errors that users see: InputError (wrong input, exit code 2) and WorkError (failed work or check, exit code 1).

Each message is one line: file, place in it, what was found, what was expected, and what the user can do.
"""

from __future__ import annotations

from typing import ClassVar


class FlockscopeError(Exception):
    """An error message for users; `str()` is exactly one line. exit_code: 1 unless a subclass says otherwise
    (InputError: 2).

    - file: the file read or written, "" if there is none. place: the line, key, row or frame in it, "" if there is
      none.
    - got: what was found there. expected: what should be there. remedy: what the user can do. All are kept as text.
    """

    exit_code: ClassVar[int] = 1

    def __init__(self, *, file: object = "", place: object = "", got: object, expected: object, remedy: str) -> None:
        self.file, self.place = str(file), str(place)
        self.got, self.expected, self.remedy = str(got), str(expected), remedy
        super().__init__(self.line())

    def line(self) -> str:
        """Returns the error as one line: "file: place: got …; expected …; remedy".

        An empty file or place is left out. Runs of white space, also line breaks, become one space.
        """
        where = ": ".join(part for part in (self.file, self.place) if part)
        text = f"{where}: " if where else ""
        text += f"got {self.got}; expected {self.expected}; {self.remedy}"
        return " ".join(text.split())

    def as_dict(self) -> dict[str, str]:
        """Returns the error object that `--json` prints, all values as text: file, place, got, expected, remedy."""
        names = ("file", "place", "got", "expected", "remedy")
        return {name: getattr(self, name) for name in names}

    def __reduce__(self) -> tuple[object, ...]:
        return (_rebuild, (type(self), self.as_dict()))


class InputError(FlockscopeError):
    """Wrong input or usage: a command that raises it ends with exit code 2.

    Keyword arguments: file and place ("" by default), got, expected, remedy. `str()` is one line of them.
    """

    exit_code: ClassVar[int] = 2


class WorkError(FlockscopeError):
    """The work failed, or a check was not passed: a command that raises it ends with exit code 1.

    Keyword arguments: file and place ("" by default), got, expected, remedy. `str()` is one line of them.
    """


def _rebuild(kind: type[FlockscopeError], parts: dict[str, str]) -> FlockscopeError:
    return kind(**parts)
