"""Fixtures shared by all tests: where real recordings lie, one thread per library, which tests are slow."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import hypothesis
import pytest

hypothesis.settings.register_profile("explore", deadline=None, print_blob=True)
hypothesis.settings.register_profile("repeatable", deadline=None, derandomize=True)
hypothesis.settings.load_profile("repeatable")
"""A test's verdict depends neither on how busy the machine is nor on chance. Other examples: --hypothesis-profile."""

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # as in a job that a shell started in the background
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real recordings: $FLOCKSCOPE_DATA or ../shared/data beside the project; skipped where absent."""
    root = Path(os.environ.get("FLOCKSCOPE_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
    if not root.is_dir():
        pytest.skip(f"real recordings are not here: {root} (set FLOCKSCOPE_DATA)")
    return root


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the tests on real recordings as slow (`make test-slow`)."""
    for item in items:
        if "shared_data" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.slow)
