"""docs/reference/commands.md holds the arguments and options of every command."""

from __future__ import annotations

from pathlib import Path

from tracking.app.commands_page import command_sections

PAGE = Path(__file__).resolve().parents[3] / "docs" / "reference" / "commands.md"


def test_the_page_holds_every_command() -> None:
    remedy = "put the output of `python -m tracking.app.commands_page` into it"
    assert command_sections() in PAGE.read_text(encoding="utf-8"), remedy


def test_sections() -> None:
    text = command_sections()
    assert text.startswith("## demo\n")
    assert "\n## export coco\n" in text
    assert "| `--shard-size SIZE` | Largest shard" in text
