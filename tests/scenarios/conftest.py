"""A scenario with every kind of order, written where a test may change it."""

from __future__ import annotations

from pathlib import Path

import pytest

SCENARIO = """
schema = 1
about = "merge, split and queue"
duration = 30.0
camera = { fps = 10, tilt_deg = 40 }
group = [
  { id = "a", size = 3, start = [5, 5], goal = [11, 5], speed = { normal = [1.2, 0.1] } },
  { id = "b", size = 2, start = [11, { uniform = [3, 5] }], goal = [8, 5], via = [[9, 4]] },
  { id = "w", size = 1, start = [13, 2], goal = [14, 2], repeat = 3 },
]

[world]
size = [16, 10]
walls = [[0, 9.5, 16, 9.5]]
doors = [{ at = [4, 9.5], width = 1.2 }]
pillars = [[2, 2, 0.5]]

[[event]]
id = "m1"
type = "merge"
groups = ["a", "b"]
into = "ab"
goal = [8, 6]
when = { distance_lt = 1.5 }

[[event]]
id = "s1"
type = "split"
group = "ab"
parts = [{ id = "c", size = 3, goal = [14, 5] }, { id = "d", size = 2, goal = [8, 8] }]
when = { after = "m1", delay = 4.0 }

[[event]]
id = "q1"
type = "queue"
groups = ["w-*", "c"]
at = [12, 7]
direction_deg = 90
service = { exponential = 3.0 }
when = { time = 12.0 }
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "tour.toml"
    file.write_text(SCENARIO)
    return file
