"""Text is printed as it is, except control characters and endless lines."""

from __future__ import annotations

import pickle
import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.errors import InputError, printable, shortened

TEXT = st.text(alphabet=st.characters(exclude_categories=()), max_size=60)


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("", ""),
        ("Zürich 北京 é 😀 [/red] x[door]y \\n", "Zürich 北京 é 😀 [/red] x[door]y \\n"),
        ("\x1b[31mred\x07", "\\x1b[31mred\\x07"),
        ("a\u202eb\u2066c\u200d", "a\\u202eb\\u2066c\\u200d"),
        ("\x9b31m\x7f", "\\x9b31m\\x7f"),
        ("\udcff", "\\udcff"),
        ("\U000e0041", "\\U000e0041"),
        ("a\u2028b\nc", "a\\u2028b\\nc"),
    ],
)
def test_control_characters_are_escaped(text, shown):
    assert printable(text) == shown
    assert printable(shown) == shown


@given(TEXT)
def test_nothing_printed_is_a_control_character(text):
    shown = printable(text)
    assert not {unicodedata.category(c) for c in shown} & {"Cc", "Cf", "Cs", "Zl", "Zp"}
    shown.encode()
    assert printable(f"{text}\n", keep="\n").endswith("\n")


def test_long_text_is_cut_in_the_middle():
    assert shortened("abcdef", 6) == "abcdef"
    assert shortened("a" * 50 + "b" * 50, 10) == "aaaaaa…bbb"


def test_an_error_is_a_short_line_whatever_was_found():
    error = InputError(file="x\x1b[2J.txt", place="line 1", got="\x1b]0;" + "9" * 1_000_000, expected="a", remedy="b")
    assert error.line().startswith("x\\x1b[2J.txt: line 1: got \\x1b]0;999")
    assert error.line().isprintable()
    assert len(error.line()) <= 400
    assert str(pickle.loads(pickle.dumps(error))) == str(error) == error.line()


def test_an_error_keeps_what_was_found_whole_up_to_a_bound():
    got = "\x1b" + "9" * 5_000
    assert InputError(got=got, expected="a", remedy="b").as_dict()["got"] == got
    assert len(InputError(got="9" * 1_000_000, expected="a", remedy="b").as_dict()["got"]) == 10_000
