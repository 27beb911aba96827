"""Whether the installed packages have versions with which flockscope works: other libraries bring older ones along."""

from __future__ import annotations

import re
from importlib.metadata import PackageNotFoundError, requires, version

from scenarios.errors import InputError

LIMIT = re.compile(r"(<|>=)([\d.]+)")


def check_installed() -> None:
    """Raises InputError if the version of an installed package is not one that flockscope's own package asks for."""
    try:
        wanted = [text for text in requires("flockscope") or () if ";" not in text]  # the others belong to extras
    except PackageNotFoundError:  # its sources are on the path, without a package
        return
    wrong = {}
    for text in wanted:
        name = re.split(r"[<>=!~ ]", text)[0]
        got = version(name)
        if not within(got, text):
            wrong[f"{name} {got}"] = text
    if wrong:
        every = " ".join(f'"{text}"' for text in wrong.values())
        raise InputError(
            place="installed packages", got=", ".join(wrong), expected=", ".join(wrong.values()),
            remedy=f"pip install {every}; a library that asks for other versions: pip install --no-deps",
        )  # fmt: skip


def within(got: str, limits: str) -> bool:
    """Returns True if a version, for example "1.26.4", is within limits such as "numpy<3,>=2.0"."""
    return all(
        _numbers(got) < _numbers(end) if sign == "<" else _numbers(got) >= _numbers(end)
        for sign, end in LIMIT.findall(limits)
    )


def _numbers(text: str) -> tuple[int, ...]:
    return tuple([*map(int, re.findall(r"\d+", text)), 0, 0, 0][:4])
