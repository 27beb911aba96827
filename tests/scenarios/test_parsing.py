"""TOML and JSON of strangers are a value or one line; what is printed has no control characters."""

from __future__ import annotations

import pickle
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.errors import InputError, printable
from scenarios.loading.toml_files import parse, parse_setting, parse_value
from sim.store.tables import read_json
from tracking.papers.blob.config import BlobConfig

TOML = {
    "5000 digits": "a = " + "9" * 5000, "beyond 64 bits": "a = 9223372036854775808",
    "nested arrays": "a = " + "[" * 5000 + "]" * 5000, "nested keys": ".".join(["a"] * 5000) + " = 1",
    "a little too deep": "a = " + "[" * 40 + "]" * 40, "a date that is none": "a = 2024-13-41",
    "UTF-16": "a = 1".encode("utf-16"), "latin-1": b"a = '\xe9'", "NUL": b"a = \x00",
}  # fmt: skip


@pytest.mark.parametrize("name", TOML)
def test_every_toml_reader_says_it_in_one_line(name, tmp_path):
    path, text = tmp_path / "x.toml", TOML[name]
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    for read in (parse, BlobConfig.from_toml):
        with pytest.raises(InputError) as error:
            read(path)
        assert error.value.file == str(path)
        assert len(str(error.value)) < 500


JSON = {
    "5000 digits": '{"a": ' + "9" * 5000 + "}",
    "beyond 64 bits": '{"a": -9223372036854775809}',
    "nested": '{"a": ' + "[" * 100_000 + "]" * 100_000 + "}",
    "a little too deep": '{"a": ' + "[" * 40 + "]" * 40 + "}",
    "NaN": '{"a": NaN}',
}


@pytest.mark.parametrize("name", JSON)
def test_json(name, tmp_path):
    (tmp_path / "x.json").write_text(JSON[name])
    with pytest.raises(InputError) as error:
        read_json(tmp_path / "x.json")
    assert len(str(error.value)) < 500


def test_values_of_settings():
    assert parse_value("[" * 20 + "1" + "]" * 20, "a=b")
    for text in ("9" * 5000, "[" * 5000, "9223372036854775808"):
        with pytest.raises(InputError, match="TOML value"):
            parse_value(text, "a=b")


TEXT = st.text(alphabet=st.characters(exclude_categories=()), max_size=60)


@given(TEXT)
def test_nothing_printed_is_a_control_character(text):
    shown = printable(text)
    assert not {unicodedata.category(c) for c in shown} & {"Cc", "Cf", "Cs", "Zl", "Zp"}
    shown.encode()
    assert printable(f"{text}\n", keep="\n").endswith("\n")


def test_an_error_is_a_short_line_whatever_was_found():
    error = InputError(file="x\x1b[2J.txt", place="line 1", got="\x1b]0;" + "9" * 1_000_000, expected="a", remedy="b")
    assert error.line().startswith("x\\x1b[2J.txt: line 1: got \\x1b]0;999")
    assert error.line().isprintable()
    assert len(error.line()) <= 400
    assert str(pickle.loads(pickle.dumps(error))) == str(error) == error.line()


def test_keys_of_settings_have_as_many_steps_as_tables_may_be_deep():
    assert len(parse_setting(".".join("a" * 32) + "=1")[0]) == 32
    with pytest.raises(InputError, match=r"got 2000 steps; expected at most 32 tables and lists inside each other"):
        parse_setting(".".join("a" * 2000) + "=1")
