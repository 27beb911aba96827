"""Texts of times, as options have them."""

from __future__ import annotations

import pytest

from scenarios.errors import InputError
from tracking.export.table_options import seconds_of


def test_seconds_of_texts():
    texts = {"10s": 10, "1m": 60, "1min": 60, "1.5h": 5400, "0": 0, "0.4": 0.4, " 2 m ": 120}
    assert {text: seconds_of(text, "--every") for text in texts} == texts


@pytest.mark.parametrize("text", ["", "s", "-1s", "1e3", "1 week", "1m30s", "nan", "١s", "1:30"])
def test_other_texts_are_refused(text):
    with pytest.raises(InputError, match=r"--every: got .*expected seconds"):
        seconds_of(text, "--every")
