"""The constants of a tracker's package as a Markdown table for the docs, read from its source.

    python -m tracking.app.constants_page group_pda

A constant is a number with an upper-case name at the top of a module, and a text after it that says what it is. Names
of slots and columns have no such number, or none of their own, and are left out.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

PAPERS = Path(__file__).parents[1] / "papers"
"""Folder of the trackers' packages."""


def constants_table(package: str) -> str:
    """Returns the constants of the package tracking.papers.`package` as a Markdown table, by module and place."""
    rows = ["| constant | value | module | meaning |", "|---|---|---|---|"]
    for path in sorted((PAPERS / package).glob("*.py")):
        found = _constants(ast.parse(path.read_text(encoding="utf-8")).body)
        rows += [f"| {name} | {value:g} | `{path.stem}` | {meaning} |" for name, value, meaning in found]
    return "\n".join([*rows, ""])


def _constants(body: list[ast.stmt]) -> Iterator[tuple[str, float, str]]:
    for statement, after in pairwise(body):
        match statement, after:
            case ast.Assign([target], value), ast.Expr(ast.Constant(str(text))):
                meaning = " ".join(text.split()).replace("|", "\\|")
                targets = target.elts if isinstance(target, ast.Tuple) else [target]
                values = value.elts if isinstance(value, ast.Tuple) else [value]
                for one, number in zip(targets, values, strict=False):
                    match one, number:
                        case ast.Name(name), ast.Constant(int() | float() as size) if name.isupper():
                            yield name, size, meaning


if __name__ == "__main__":
    print(constants_table(sys.argv[1]), end="")
