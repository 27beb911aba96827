"""A scenario with every kind of order, written where a test may change it."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return Path(shutil.copy(Path(__file__).with_name("tour.toml"), tmp_path))
