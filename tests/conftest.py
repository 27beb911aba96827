"""Fixtures shared by all tests: where real recordings lie, and one thread per library."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real recordings: $FLOCKSCOPE_DATA or ../shared/data beside the project; skipped where absent."""
    root = Path(os.environ.get("FLOCKSCOPE_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
    if not root.is_dir():
        pytest.skip(f"real recordings are not here: {root} (set FLOCKSCOPE_DATA)")
    return root
