"""Python in a process of its own, and the trackers of the tests as commands name them."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FAKE = f"{ROOT}/tests/fake_tracker.py:Nearest"
TOY = f"{ROOT}/tests/toy_tracker.py:Toy"


def python(*words: object, **env: str) -> subprocess.CompletedProcess:
    """Runs Python in the project's folder, with these variables beside those of this process, for 600 s at most."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **env}
    return subprocess.run(
        [sys.executable, *map(str, words)], cwd=ROOT, env=environment, capture_output=True, text=True, timeout=600,
        check=False,
    )  # fmt: skip
