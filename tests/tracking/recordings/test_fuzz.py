"""Damaged inputs of every kind end with a result or an error of one line, within bounds of time and memory."""

import json
import resource
import shutil
import tempfile
import warnings
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchmarks.support.timing import stopped_after
from scenarios.errors import FlockscopeError
from sim import hashing
from sim.store.seal import with_hash
from sim.store.tables import json_document
from tests.damaged.mutations import mutate
from tests.damaged.readers import FILES, READERS
from tests.damaged.specimens import KINDS, write_specimens, write_texts

EVERY = settings(
    max_examples=100, deadline=None, database=None, suppress_health_check=list(HealthCheck), print_blob=True
)
SEALS = {"dataset": "manifest.json", "run": "run.json"}
LONGEST_LINE = 20_000
SIMULATED = "simulated-scenario"
QUICK = [pytest.param(kind, marks=pytest.mark.slow if kind == SIMULATED else ()) for kind in KINDS]


class Overtime(BaseException):
    """Raised by the timer; no reader catches it."""


@contextmanager
def bounded(seconds=20.0, memory=4 * 2**30):
    """Raises Overtime after `seconds` of CPU time, MemoryError beyond `memory` more bytes."""
    limits = resource.getrlimit(resource.RLIMIT_AS)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + memory, limits[1]))
    try:
        with stopped_after(seconds, Overtime(f"more than {seconds:g} s")):
            yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)


def read(kind, folder):
    """Reads an input; returns False if it is refused, with an error for users of one line. Warnings of numpy fail."""
    try:
        with warnings.catch_warnings(), bounded():
            warnings.simplefilter("ignore")
            warnings.simplefilter("error", RuntimeWarning)
            READERS[kind](folder)
    except FlockscopeError as error:
        line = str(error)
        assert "\n" not in line, line
        assert len(line) <= LONGEST_LINE
        complete = error.got and error.expected and error.remedy
        assert complete, line
        return False
    return True


@cache
def compile_kernels(kind, whole):
    """A scene is simulated once without bounds of time, which compiles the kernels."""
    if kind == SIMULATED:
        READERS[kind](whole)


@pytest.fixture(scope="module")
def texts():
    with tempfile.TemporaryDirectory() as root:
        yield write_texts(Path(root))


@pytest.fixture(scope="module")
def specimens():
    with tempfile.TemporaryDirectory() as root:
        found = write_specimens(Path(root))
        yield found | {"truth": found["dataset"]}


def seal_again(path):
    """Makes the hashes of a manifest or run.json fit the files as they are."""
    document = json.loads(path.read_bytes())
    for name, facts in document["files"].items():
        body = (path.parent / name).read_bytes()
        facts.update(sha256=hashing.file_hash(body), bytes=len(body))
    path.write_bytes(json_document(with_hash(document)))


def try_one(kind, whole, random):
    """Damages one file of a copy and reads it. Half of the datasets and runs get hashes that fit the damaged file."""
    compile_kernels(kind, whole)
    with tempfile.TemporaryDirectory() as root:
        folder = Path(shutil.copytree(whole, Path(root) / "case"))
        names = sorted(str(p.relative_to(folder)) for p in folder.rglob("*") if p.is_file())
        name = random.choice([name for name in names if name.startswith(FILES.get(kind, ("",)))])
        (folder / name).write_bytes(mutate((folder / name).read_bytes(), random))
        if kind in SEALS and random.random() < 0.5:
            with suppress(ValueError, KeyError, TypeError, AttributeError, OSError, RecursionError):
                seal_again(folder / SEALS[kind])
        read(kind, folder)


@pytest.mark.parametrize("kind", QUICK)
@given(random=st.randoms(use_true_random=False))
@settings(EVERY, max_examples=5)
def test_damaged_texts(kind, texts, random):
    try_one(kind, texts[kind], random)


@pytest.mark.parametrize("kind", QUICK)
def test_whole_texts_are_read(kind, texts):
    compile_kernels(kind, texts[kind])
    assert read(kind, texts[kind])


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
    assert read(kind, specimens[kind])
