"""A tracker in a process of its own: the same answers, and an error where it hangs or ends its process."""

from __future__ import annotations

import os

import numpy as np
import pytest

from scenarios.errors import InputError, WorkError
from scenarios.loading.resolve import load
from sim.sequence import simulate
from sim.types import Detections, Frame, Sequence
from tracking.app.cli import run
from tracking.running import tracker_registry
from tracking.running.run import track
from tracking.running.time_limit import TimeLimited

pytestmark = pytest.mark.slow  # processes that hang and are ended

TRACKER = """
import ctypes, os, re, signal, sys, time
import numpy as np
from dataclasses import dataclass
from typing import ClassVar
from sim.types import Tracks
from tracking.config import Config, param

WAYS = ("well", "python", "compiled", "exit", "killed", "sys_exit", "interrupt", "reset")

@dataclass(frozen=True)
class Settings(Config):
    tracker: ClassVar[str] = "mine"
    how: str = param("well", WAYS, "", "how it fails", "categorical")
    reach: float = param(1.0, (0.5, 2.0), "m", "a step hangs unless it is 1")

def hang():
    re.match(r"(a+)+$", "a" * 60 + "b")  # compiled code that holds the interpreter's lock

class Tracker:
    config_class = Settings
    needs = ("points", "boxes")
    px_per_m = np.float32(21)
    diagnostics = {"ways": list(WAYS)}
    camera_moves = property(lambda self: self.config.reach > 1.0)
    def __init__(self, config):
        self.config = config
    def reset(self, context, seed):
        if self.config.how == "reset":
            hang()
    def step(self, frame, detections):
        how = self.config.how if self.config.reach == 1.0 else "compiled"
        if frame.index == 3:
            if how == "python":
                while True:
                    time.sleep(0.01)
            if how == "compiled":
                hang()
            if how == "exit":
                os._exit(0)
            if how == "killed":
                os.kill(os.getpid(), signal.SIGKILL)
            if how == "sys_exit":
                sys.exit(0)
            if how == "interrupt":
                raise KeyboardInterrupt
        n = len(detections.pos)
        unknown, ids = np.full((n, 2), np.nan), np.arange(n)
        return Tracks(frame.index, frame.t, detections.plane, "person", ids, ids - ids - 1, detections.pos, unknown,
                      np.tile(np.eye(4), (n, 1, 1)))
"""


@pytest.fixture(scope="module")
def mine(tmp_path_factory):
    file = tmp_path_factory.mktemp("trackers") / "mine.py"
    file.write_text(TRACKER)
    return f"{file}:Tracker"


def five_frames() -> Sequence:
    pos = np.array([[1.0, 2.0], [3.0, 4.0]])
    frames = [Frame(k, k / 10, detections=Detections(k, k / 10, "ground", pos + k)) for k in range(1, 6)]
    return Sequence("five", 10.0, 5, lambda: iter(frames), has_detections=True)


def test_whatever_happens_to_the_process_is_an_error_that_names_the_frame(mine):
    kinds = {
        "python": "TimeoutError: no answer within 2 s", "compiled": "TimeoutError: no answer within 2 s",
        "exit": "ChildProcessError: its process ended with exit code 0",
        "killed": "ChildProcessError: its process ended with signal 9", "sys_exit": "SystemExit: 0",
        "interrupt": "RuntimeError: KeyboardInterrupt",
    }  # fmt: skip
    with TimeLimited(mine, 2.0) as limited:
        for how, words in kinds.items():
            with pytest.raises(WorkError, match=f"five, frame 3: got {words}") as caught:
                track(limited, five_frames(), params={"how": how})
            assert mine in str(caught.value)
        with pytest.raises(WorkError, match="five: got TimeoutError"):
            track(limited, five_frames(), params={"how": "reset"})
        assert len(track(limited, five_frames())) == 5


def test_the_answers_are_those_of_the_tracker_in_this_process(mine):
    sequence = simulate(load("merge", ["camera.fps=5"]), 40_001)
    for name in ("blob", mine):
        with TimeLimited(name, 60.0) as limited:
            here, there = track(name, sequence), track(limited, sequence)
            again = track(limited, sequence)
        for a, b, c in zip(here, there, again, strict=True):
            for field in ("id", "group", "pos", "vel", "cov", "box", "score"):
                values = [getattr(t, field) for t in (a, b, c)]
                assert all(v is None for v in values) or all(
                    np.array_equal(values[0], v, equal_nan=True) for v in values[1:]
                )
        assert {k: v for k, v in here.info.items() if "frames_per" not in k} == {
            k: v for k, v in there.info.items() if "frames_per" not in k
        }


def test_attributes_are_those_of_the_tracker_in_the_process(mine):
    with TimeLimited(mine, 60.0) as limited:
        other = tracker_registry.find(mine)
        made = limited.make(other.config_class())
        made.reset(None, 0)
        assert made.diagnostics == other.diagnostics
        assert made.px_per_m == 21
        assert not hasattr(made, "walking_together")
        assert not made.camera_moves
        made.config = other.config_class(reach=1.5)
        made.reset(None, 0)
        assert made.camera_moves
        assert made.config.reach == 1.5
        limited.close()
        assert made.px_per_m == 21
        assert not hasattr(made, "diagnostics")
        assert "diagnostics" in track(limited, five_frames()).info


def test_a_tracker_without_a_config_keeps_none(tmp_path):
    (tmp_path / "plain.py").write_text(TRACKER.replace("self.config = config", "self.settings = config"))
    name = f"{tmp_path / 'plain.py'}:Tracker"
    with TimeLimited(name, 60.0) as limited:
        assert not hasattr(limited.make(tracker_registry.find(name).config_class()), "config")


def test_no_process_is_left(mine):
    with TimeLimited(mine, 60.0) as limited:
        track(limited, five_frames())
        pid = limited._process._process.pid
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("nan"), float("inf"), 2.2e6])
def test_the_limit_is_a_time(seconds):
    with pytest.raises(InputError, match="--step-timeout"):
        TimeLimited("blob", seconds)


def test_track_by_command(tmp_path, capsys, mine):
    tmp_path.joinpath("gt.txt").write_text("".join(f"{k},1,10,10,20,50,1,1,1\n" for k in range(1, 6)))
    line = ["track", mine, str(tmp_path / "gt.txt"), "--fps", "10", "--step-timeout", "2"]
    assert run([*line, "--out", str(tmp_path / "well")]) == 0
    assert run([*line, "--out", str(tmp_path / "out"), "--set", "how=compiled"]) == 1
    assert "gt, frame 3: got TimeoutError: no answer within 2 s (--step-timeout)" in capsys.readouterr().err
    assert not tmp_path.joinpath("out").exists()
    assert run([*line[:-1], "0", "--out", str(tmp_path / "out")]) == 2


@pytest.mark.parametrize("workers", ["1", "2"])
def test_in_a_search_a_trial_that_hangs_is_impossible(tmp_path, capsys, mine, workers):
    line = ["tune", mine, "--only", "reach", "--suite", "merge", "--set", "scenario.camera.fps=2", "--trials", "3"]
    line += ["--seeds", "0:2", "--validation", "10000:10001", "--test", "20000:20001", "--check", "none"]
    line += ["--workers", workers]
    assert run([*line, "--step-timeout", "3", "--out", str(tmp_path / "best.toml"), "--json"]) == 0
    assert '"impossible": 2' in capsys.readouterr().out


def test_a_class_cannot_be_looked_up():
    with pytest.raises(InputError, match="name that another process can look up"):
        TimeLimited(int, 1.0)  # type: ignore[arg-type]
