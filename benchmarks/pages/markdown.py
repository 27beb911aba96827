"""Docstrings and tables as Markdown that reads alike on a code host and on the site."""

from __future__ import annotations

import re

CODE = re.compile(r"(`+[^`]*`+)")
INDENTED = re.compile(r"^(?: {4}.*\n?)(?:(?: {4}.*)?\n?)*(?<=\n)|^ {4}.*$", re.MULTILINE)
APART = re.compile(r" {2,}")


def table(*columns: str, rows: list[str]) -> str:
    """Returns a Markdown table of rows that are written out."""
    return "\n".join([f"| {' | '.join(columns)} |", "|---" * len(columns) + "|", *rows])


def row(*cells: str) -> str:
    """Returns a row of a Markdown table."""
    return f"| {' | '.join(cells)} |"


def cell(text: str) -> str:
    """Returns a text as a cell of a table."""
    return " ".join(text.split()).replace("|", "\\|")


def escaped(text: str) -> str:
    """Returns a text in which what looks like an HTML element, outside of code, is text."""
    parts = CODE.split(text)
    return "".join(part if k % 2 else re.sub(r"<(?=[a-z])", r"\\<", part) for k, part in enumerate(parts))


def prose(text: str, heading: str = "") -> str:
    """Returns a docstring with its indented tables of two columns as Markdown tables; other indented blocks are code.

    heading: of the first column.
    """
    blocks = text.split("\n\n")
    return "\n\n".join(_block(block, heading) if block.startswith("    ") else escaped(block) for block in blocks)


def _block(block: str, heading: str) -> str:
    found: list[list[str]] = []
    for line in block.splitlines():
        first, *rest = APART.split(line.removeprefix("    "), maxsplit=1)
        if first and rest:
            found.append([first, rest[0]])
        elif not first and rest and found:
            found[-1][1] += f" {rest[0]}"
        else:
            return block
    rows = [row(f"`{name}`" if heading else name, cell(meaning)) for name, meaning in found]
    return table(heading, "meaning", rows=rows)
