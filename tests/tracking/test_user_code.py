"""A tracker's own code cannot end a command as if all were well: sys.exit, KeyboardInterrupt, GeneratorExit."""

from __future__ import annotations

import numpy as np
import pytest

from scenarios.errors import InputError, WorkError
from sim.types import Detections, Frame, Sequence
from tests.tracking.running.test_run import Stranger
from tracking.app.cli import run
from tracking.running.run import track
from tracking.user_code import recorded_interrupts

ABRUPT = [SystemExit(0), SystemExit("done"), GeneratorExit(), BaseException("what"), StopIteration(), ValueError("no")]

TRACKER = """
import signal, sys
import numpy as np
from dataclasses import dataclass
from typing import ClassVar
from sim.types import Tracks
from tracking.config import Config, param

def fail(part):
    if part == "{part}":
        {statement}

fail("import")

@dataclass(frozen=True)
class Settings(Config):
    tracker: ClassVar[str] = "mine"
    reach: float = param(1.0, (0.5, 2.0), "m", "no effect")
    def check(self):
        fail("check" if self.reach == 1.0 else "check of others")

class Tracker:
    config_class = Settings
    needs = ("points", "boxes")
    fail("class body")
    def __init__(self, config):
        self.config = config
        fail("__init__")
    def reset(self, context, seed):
        fail("reset")
    def step(self, frame, detections):
        if frame.index == 3:
            fail("step" if self.config.reach == 1.0 else "step of others")
        none, ids = np.zeros((0, 2)), np.zeros(0, int)
        return Tracks(frame.index, frame.t, detections.plane, "person", ids, ids, none, none, np.zeros((0, 4, 4)))
"""
# What a part of a tracker does, and what is said of it.
STATEMENTS = {
    "sys.exit(0)": "SystemExit: 0", "raise KeyboardInterrupt": "KeyboardInterrupt",
    "raise GeneratorExit": "GeneratorExit", "raise ValueError('boo\\nand more')": "ValueError: boo;",
}  # fmt: skip


def command(tmp_path, part, statement):
    tmp_path.joinpath("mine.py").write_text(TRACKER.format(part=part, statement=statement))
    tmp_path.joinpath("gt.txt").write_text("".join(f"{k},1,10,10,20,50,1,1,1\n" for k in range(1, 9)))
    return [
        "track", f"{tmp_path}/mine.py:Tracker", str(tmp_path / "gt.txt"), "--fps", "10", "--out",
        str(tmp_path / "out"),
    ]  # fmt: skip


@pytest.mark.parametrize("statement", STATEMENTS)
@pytest.mark.parametrize("part", ["import", "class body", "check", "__init__", "reset", "step"])
def test_track_fails_with_one_line(tmp_path, capsys, part, statement):
    code = run(command(tmp_path, part, statement))
    printed = capsys.readouterr()
    assert code == (2 if part in ("import", "class body") else 1)
    assert not tmp_path.joinpath("out").exists()
    (line,) = printed.err.strip().splitlines()
    assert STATEMENTS[statement] in line
    assert "mine" in line
    assert "bug" not in line
    assert "gt, frame 3" in line or part != "step"


def test_ctrl_c_stays_an_interruption_whatever_the_tracker_makes_of_it(tmp_path, capsys):
    swallowed = """
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise SystemExit(0)"""
    for statement in ("signal.raise_signal(signal.SIGINT)", swallowed):
        assert run(command(tmp_path, "step", statement)) == 130
        assert "interrupted" in capsys.readouterr().err


class Abrupt(Stranger):
    def step(self, frame, detections):
        raise self.error


def nobody() -> Sequence:
    frames = [Frame(1, 0.0, detections=Detections(1, 0.0, "ground", np.zeros((0, 2))))]
    return Sequence("s", 10.0, 1, lambda: iter(frames), has_detections=True)


@pytest.mark.parametrize("error", ABRUPT, ids=repr)
def test_in_python_everything_that_is_raised_is_a_work_error(error):
    tracker = Abrupt()
    tracker.error = error
    with pytest.raises(WorkError, match=f"s, frame 1: got {type(error).__name__}") as caught:
        track(tracker, nobody())
    assert caught.value.__cause__ is error


def test_in_python_a_keyboard_interrupt_passes_where_it_may_be_ctrl_c():
    tracker = Abrupt()
    tracker.error = KeyboardInterrupt()
    with pytest.raises(KeyboardInterrupt):
        track(tracker, nobody())
    with recorded_interrupts(), pytest.raises(WorkError, match="KeyboardInterrupt"):
        track(tracker, nobody())


def test_no_exit_from_within_ends_a_command_as_if_all_were_well(tmp_path, capsys, monkeypatch):
    """Whatever code of a user is reached by another way, as a property that a command reads."""

    def leave(options):
        raise SystemExit(0)

    monkeypatch.setattr("tracking.app.commands.track.track", leave)
    assert run(command(tmp_path, "", "pass")) == 1
    assert "SystemExit: 0" in capsys.readouterr().err


@pytest.mark.parametrize("seed", [2**63, 10**30, -1, 1.5, True])
def test_a_wrong_seed_is_found_before_the_tracker_is_made(seed):
    class Never(Abrupt):
        def __init__(self):
            raise AssertionError("made")

    with pytest.raises(InputError, match=r"--seed: got .* expected a whole number from 0 to 9223372036854775807"):
        track(Never, nobody(), seed=seed)
