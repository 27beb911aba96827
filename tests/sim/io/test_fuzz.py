"""Damaged inputs of every kind end with a result or an error of one line, within bounds of time and memory.

An hour of it: python -m benchmarks.fuzz --minutes 60.
"""

import shutil
import tempfile
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchmarks.fuzz.cases import case, outcome
from benchmarks.fuzz.readers import READERS
from benchmarks.fuzz.specimens import TEXTS, write_specimens, write_texts

EVERY = settings(
    max_examples=100, deadline=None, database=None, suppress_health_check=list(HealthCheck), print_blob=True
)


SIMULATED = "simulated scenario"
QUICK = [pytest.param(kind, marks=pytest.mark.slow if kind == SIMULATED else ()) for kind in TEXTS]


@pytest.fixture(scope="module")
def texts():
    root = Path(tempfile.mkdtemp())
    yield write_texts(root)
    shutil.rmtree(root)


@cache
def compile_kernels(kind, whole):
    """A scene is simulated once without bounds of time, which compiles the kernels."""
    if kind == SIMULATED:
        READERS[kind](whole)


@pytest.fixture(scope="module")
def specimens():
    root = Path(tempfile.mkdtemp())
    found = write_specimens(root)
    yield found | {"truth": found["dataset"]}
    shutil.rmtree(root)


def try_one(kind, whole, random):
    compile_kernels(kind, whole)
    folder = Path(tempfile.mkdtemp())
    try:
        name, found = case(kind, whole, folder / "case", random)
    finally:
        shutil.rmtree(folder)
    assert found.kind != "bug", f"{name}: {found.text}"


@pytest.mark.parametrize("kind", QUICK)
def test_whole_texts_are_read(kind, texts):
    compile_kernels(kind, texts[kind])
    assert outcome(kind, texts[kind]).kind == "ok", outcome(kind, texts[kind])


@pytest.mark.parametrize("kind", QUICK)
@given(random=st.randoms(use_true_random=False))
@settings(EVERY, max_examples=5)
def test_damaged_texts(kind, texts, random):
    try_one(kind, texts[kind], random)


@pytest.mark.slow
@pytest.mark.parametrize("kind", READERS)
@given(random=st.randoms(use_true_random=False))
@settings(EVERY)
def test_damaged_inputs(kind, specimens, random):
    try_one(kind, specimens[kind], random)


@pytest.mark.slow
@pytest.mark.parametrize("kind", READERS)
def test_whole_inputs_are_read(kind, specimens):
    compile_kernels(kind, specimens[kind])
    assert outcome(kind, specimens[kind]).kind == "ok", outcome(kind, specimens[kind])
