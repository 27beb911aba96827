"""A command whose options are the fields of a dataclass: names, defaults, required ones, lists, `--json`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest
import typer

from tracking.app.command_line import add_command, run_command
from tracking.app.command_result import CommandResult
from tracking.keyword_options import option


@dataclass(frozen=True, kw_only=True)
class FruitOptions:
    """Sell fruit."""

    name: str = option("Which fruit.", metavar="NAME", flag="")
    colour: str | None = option("Its colour.", None, metavar="C")
    out: Path = option("Where to.")
    count: int = option("How many.", 3, low=1)
    settings: list[str] = option("Set a value.", [], flag="--set", metavar="K=V")


@dataclass(frozen=True, kw_only=True)
class NoOptions:
    """Makes the first command one of two."""


@pytest.fixture
def app() -> typer.Typer:
    made = typer.Typer(rich_markup_mode=None)
    add_command(made, "fruit", FruitOptions, lambda options: CommandResult({}, repr(options)))
    add_command(made, "other", NoOptions, lambda options: CommandResult({}))
    return made


def test_the_command_gets_one_instance_with_the_defaults(app, capsys):
    assert run_command(app, ["fruit", "apple", "--out", "x"]) == 0
    assert capsys.readouterr().out.strip() == repr(FruitOptions(name="apple", out=Path("x")))


def test_every_option_arrives_and_lists_start_empty_each_time(app, capsys):
    given = ["fruit", "apple", "--out", "x", "--colour", "red", "--count", "5", "--set", "a=1", "--set", "b=2"]
    assert run_command(app, given) == 0
    expected = FruitOptions(name="apple", colour="red", out=Path("x"), count=5, settings=["a=1", "b=2"])
    assert capsys.readouterr().out.strip() == repr(expected)
    assert run_command(app, ["fruit", "apple", "--out", "x"]) == 0
    assert capsys.readouterr().out.strip() == repr(FruitOptions(name="apple", out=Path("x")))


def test_json_needs_no_field(app, capsys):
    assert run_command(app, ["fruit", "apple", "--out", "x", "--json"]) == 0
    assert capsys.readouterr().out.strip() == '{"status": "ok"}'


def test_help_lists_options_in_the_order_of_the_fields(app, capsys):
    assert run_command(app, ["fruit", "--help"]) == 0
    text = capsys.readouterr().out
    assert "Sell fruit." in text
    places = [text.index(word) for word in ("Which fruit.", "--colour C", "--out", "--count", "--set K=V", "--json")]
    assert places == sorted(places)
    assert "[required]" in text


@pytest.mark.parametrize(
    ("more", "words"),
    [(["apple"], "--out"), (["--out", "x"], "NAME"), (["apple", "--out", "x", "--count", "0"], "--count")],
)
def test_missing_and_wrong_options_are_usage_errors(app, more, words, capsys):
    assert run_command(app, ["fruit", *more]) == 2
    assert words in capsys.readouterr().err
