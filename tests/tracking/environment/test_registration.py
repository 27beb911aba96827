"""The environment is registered whoever comes first, without Gymnasium being imported for it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]


def run(*lines):
    """Run lines in a fresh interpreter."""
    program = "\n".join(["import sys", *lines])
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stderr


KNOWN = "assert gymnasium.registry['flockscope/Tuning-v0'].entry_point == 'tracking.environment.env:TuningEnv'"


@pytest.mark.parametrize(
    "lines",
    [
        ("import tracking", "assert 'gymnasium' not in sys.modules", "import gymnasium", KNOWN),
        ("import gymnasium, tracking", KNOWN),
        ("import tracking, gymnasium.wrappers", KNOWN),
        ("import tracking, importlib.util", "importlib.util.find_spec('gymnasium')", "import gymnasium", KNOWN),
        ("import gymnasium", "env = gymnasium.make('tracking:flockscope/Tuning-v0', tracker='blob')", KNOWN),
    ],
)
def test_it_is_known(lines):
    run(*lines)
