"""What all tests share: real recordings, one thread per library, slow tests, kernels compiled once, less garbage."""

from __future__ import annotations

import fcntl
import gc
import os
import signal
import tempfile
import zlib
from pathlib import Path
from typing import Any

import hypothesis
import pytest
from numba.core.caching import NullCache
from numba.core.dispatcher import Dispatcher

hypothesis.settings.register_profile("explore", deadline=None, print_blob=True)
hypothesis.settings.register_profile("repeatable", deadline=None, derandomize=True)
hypothesis.settings.load_profile("repeatable")
"""A test's verdict depends neither on how busy the machine is nor on chance. Other examples: --hypothesis-profile."""

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

gc.set_threshold(10_000, 20, 50)

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as in a job that a shell started in the background
    signal.signal(signal.SIGINT, signal.default_int_handler)


LOCKS = Path(tempfile.gettempdir(), f"flockscope-tests-{os.getuid()}.lock")


def compile_in_turn() -> None:
    """Lets one process compile a kernel while the others wait, to find it in numba's cache afterwards.

    The workers of pytest-xdist need the same kernels at the same time, and would each compile all of them.
    """
    compiled, locks = Dispatcher.compile, LOCKS.open("a")

    def compile_alone(self: Any, signature: Any) -> Any:
        if isinstance(self._cache, NullCache):
            return compiled(self, signature)
        code = self.py_func.__code__
        place = zlib.crc32(f"{code.co_filename}:{code.co_name}".encode())
        fcntl.lockf(locks, fcntl.LOCK_EX, 1, place)  # which ends with the process, whatever happens to it
        try:
            return compiled(self, signature)
        finally:
            fcntl.lockf(locks, fcntl.LOCK_UN, 1, place)

    Dispatcher.compile = compile_alone


if "PYTEST_XDIST_WORKER" in os.environ:
    compile_in_turn()


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real recordings: $FLOCKSCOPE_DATA or ../shared/data beside the project; skipped where absent."""
    root = Path(os.environ.get("FLOCKSCOPE_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
    if not root.is_dir():
        pytest.skip(f"real recordings are not here: {root} (set FLOCKSCOPE_DATA)")
    return root


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--write-guides", action="store_true", help="write what commands print into the guides")


def pytest_collection_finish() -> None:
    """Looking through all modules and tests again and again for garbage took a tenth of the time."""
    gc.freeze()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests on real recordings as slow (`make test-slow`)."""
    for item in items:
        if "shared_data" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.slow)
