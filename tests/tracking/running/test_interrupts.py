"""Ctrl-C that Python loses in a destructor still ends a command with 130."""

import signal

import pytest

from tracking.app.cli import run
from tracking.running.interrupts import raise_if_interrupted, recorded_interrupts

TRACKER = """
import os, signal, time
import numpy as np
from sim.types import Tracks

class Losing:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.01)

class Tracker:
    needs = ("points",)
    def reset(self, context, seed):
        pass
    def step(self, frame, detections):
        if frame.index == 2:
            lost = Losing()
            del lost
        none, ids = np.zeros((0, 2)), np.zeros(0, int)
        return Tracks(frame.index, frame.t, "ground", "person", ids, ids, none, none, np.zeros((0, 4, 4)))
"""


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_interrupt_that_python_loses_ends_the_command(tmp_path, capsys):
    (tmp_path / "losing.py").write_text(TRACKER)
    (tmp_path / "gt.txt").write_text("".join(f"{k},1,10,10,20,50,1,1,1\n" for k in range(1, 30)))
    out = tmp_path / "out"
    line = ["track", f"{tmp_path}/losing.py:Tracker", str(tmp_path / "gt.txt"), "--fps", "10", "--out", str(out)]
    assert run(line) == 130
    assert "interrupted" in capsys.readouterr().err
    assert not out.exists()
    raise_if_interrupted()  # the record ends with the command
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_an_interrupt_is_raised_where_it_arrives():
    with pytest.raises(KeyboardInterrupt), recorded_interrupts():
        signal.raise_signal(signal.SIGINT)
    raise_if_interrupted()


def test_a_program_with_its_own_handler_keeps_it():
    def own(number, frame):
        pass

    before = signal.signal(signal.SIGINT, own)
    try:
        with recorded_interrupts():
            assert signal.getsignal(signal.SIGINT) is own
        assert signal.getsignal(signal.SIGINT) is own
    finally:
        signal.signal(signal.SIGINT, before)
