"""The tables of docs/reference/commands.md: every command with its arguments and options, as `--help` has them.

`python -m tracking.app.commands_page` prints them.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import typer

from tracking.app.cli import app


def command_sections() -> str:
    """Returns one Markdown section per command: its help text, and a table of its arguments and options."""
    root: Any = typer.main.get_command(app)
    return "\n".join(_section(name, command) for name, command in _commands(root, ""))


def _commands(group: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    for name, command in group.commands.items():
        if hasattr(command, "commands"):
            yield from _commands(command, f"{prefix}{name} ")
        else:
            yield f"{prefix}{name}", command


def _section(name: str, command: Any) -> str:
    context = command.context_class(command, info_name=name)
    records = (parameter.get_help_record(context) for parameter in command.params)
    rows = [f"| `{_cell(option)}` | {_cell(text)} |" for option, text in filter(None, records)]
    return "\n".join([f"## {name}", "", command.help, "", "| argument or option | meaning |", "|---|---|", *rows, ""])


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


if __name__ == "__main__":
    print(command_sections())
