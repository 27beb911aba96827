"""The commands of the program as typer knows them, each with the words that call it."""

from typing import Any

import typer

from tracking.app.cli import app


def commands() -> dict[tuple[str, ...], Any]:
    """Returns all commands by the words that call them."""
    found, groups = {}, [((), typer.main.get_command(app))]
    for above, group in groups:
        for name, command in group.commands.items():
            if hasattr(command, "commands"):
                groups.append(((*above, name), command))
            else:
                found[*above, name] = command
    return found
