"""Datasets with pictures: the same bytes however they are made, also after a kill in the middle of them."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from scenarios.loading.resolve import Entry
from sim.dataset.generate import generate
from sim.io.files import atomic
from sim.io.source import open_source
from sim.io.store.validate import validate
from tests.fake_simulator import content, scenario

ROOT = Path(__file__).resolve().parents[3]
STREAMS = ("left", "right", "disparity", "ids")

# A program of its own: simulate is a fake, in its workers too. Arguments: folder, workers, images, and before which
# frame that is drawn it is killed, 0 = none.
PROGRAM = f"""
import os, signal, sys, types
from dataclasses import replace
from tests import fake_simulator as fakes
kill_after = int(sys.argv[4]) if len(sys.argv) > 4 else 0
count = 0

def tick():
    global count
    count += 1
    if count == kill_after:
        os.kill(os.getpid(), signal.SIGKILL)

def simulate(scenario, seed, repeat, streams, stride):
    live = fakes.pictured(seed + 100 * repeat, streams)
    def frames():
        for frame in live:
            tick()
            yield frame
    return replace(live, frames=frames)

sys.modules["sim.sequence"] = types.SimpleNamespace(simulate=simulate, observe=None)
from scenarios.loading.resolve import Entry
from scenarios.schema.scenario import Scenario
from sim.dataset.generate import generate
from sim.workers.start import WorkerOptions

if __name__ == "__main__":
    scenario = Scenario.model_validate({{"schema": 1, "group": [{{"id": "a", "start": [1, 1], "goal": [2, 2]}}]}})
    entries = [Entry("x", scenario, 0), Entry("y-1", scenario, 1)]
    workers = WorkerOptions(int(sys.argv[2]))
    generate(entries, range(2), sys.argv[1], workers=workers, streams={STREAMS!r}, images=sys.argv[3])
"""


def run(tmp_path, out, workers, images, kill_after=0):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    return subprocess.run(
        [sys.executable, str(program), str(out), str(workers), images, str(kill_after)],
        env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, timeout=120, check=False,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("images", ["jpg", "mp4"])
def test_any_number_of_workers_and_kills_make_the_same_bytes(tmp_path, images):
    done = run(tmp_path, tmp_path / "one", 1, images)
    assert done.returncode == 0, done.stderr.decode()
    right = content(tmp_path / "one")
    assert run(tmp_path, tmp_path / "two", 2, images).returncode == 0
    assert content(tmp_path / "two") == right
    for kill_after in (2, 12, 31):
        out = tmp_path / f"killed-{kill_after}"
        assert run(tmp_path, out, 1, images, kill_after).returncode == -signal.SIGKILL
        assert [p for p in out.glob("flockscope-train/[!.]*") if not (p / "manifest.json").is_file()] == []
        assert list(out.rglob(f"{atomic.PARTIAL}*"))
        assert run(tmp_path, out, 1, images).returncode == 0
        assert content(out) == right
    assert validate(tmp_path / "one") == []


def test_streams_are_asked_for_and_stored(tmp_path, simulate):
    made = generate([Entry("x", scenario())], range(2), tmp_path, streams=["right", "left"], images="png")
    assert simulate.asked == [(seed, ("left", "right", "background")) for seed in (0, 1)]
    (sequence,) = open_source(made[0])
    assert (sequence.has_images, sequence.has_right) == (True, True)
    simulate.asked.clear()
    generate([Entry("x", scenario())], range(2), tmp_path, streams=["right", "left"], images="png")
    assert simulate.asked == []


def alter(path: Path) -> None:
    """Other bytes, as many as before."""
    path.write_bytes(path.read_bytes()[:-5] + bytes(5))


@pytest.mark.parametrize("harm", [alter, Path.unlink])
@pytest.mark.parametrize("name", ["img1/000003.jpg", "background/000009.jpg"])
def test_altered_pictures_are_made_anew(tmp_path, simulate, harm, name):
    (made,) = generate([Entry("x", scenario())], range(1), tmp_path, streams=("left",))
    before = content(tmp_path)
    harm(made / name)
    simulate.asked.clear()
    generate([Entry("x", scenario())], range(1), tmp_path, streams=("left",))
    assert [seed for seed, _ in simulate.asked] == [0]
    assert content(tmp_path) == before
