"""What a tracker may not do to a run: change the working folder of the command, end the process, report what no command
can read."""

from __future__ import annotations

import json
import math
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import tracking
from scenarios.errors import WorkError
from sim.store.track_files import write_tracks
from sim.types import Groups
from tests.tracking.running.test_run import Stranger, source
from tests.tracking.running.test_tracks_check import SQUARE, answer, event, group
from tracking.app.cli import run
from tracking.recordings.track_texts import read_tracks
from tracking.running.run import track
from tracking.running.tracks_check import check_tracks

ENV = {**os.environ, "PYTHONPATH": str(Path(tracking.__file__).parents[1])}
FAR = 1_000_001.0
BEYOND = [
    ({"events": (event(end=2**62),)}, "end 4611686018427387904; expected a whole number from 2 to 1000000"),
    ({"events": (event(before=(10**25,)),)}, "before .10000000000000000000000000,."),
    ({"events": (event(after=(2**63,)),)}, "after"), ({"events": (event(pos=(FAR, 0.0)),)}, "pos .1000001.0"),
    ({"events": (event(pos=(math.inf, 0.0)),)}, "pos .inf"), ({"events": (event(pos=(True, 0.0)),)}, "pos .True"),
    ({"pos": np.array([[0, 1e300], [0, 0]])}, "1e.300 in pos; expected numbers from -1e.06 to 1e.06"),
    ({"pos": np.array([[0, -FAR], [0, 0]])}, "-1e.06 in pos"), ({"vel": np.array([[np.nan, FAR], [0, 0]])}, "in vel"),
    ({"box": np.full((2, 4), FAR)}, "in box"), ({"score": np.array([1e300, 0])}, "1e.300 in score"),
    ({"groups": group(pos=np.full((1, 2), FAR))}, "in groups.pos"),
    ({"groups": group(size=np.array([-1.0]))}, "size -1"),
    ({"groups": group(extent=np.full((1, 2, 2), FAR))}, "in groups.extent"),
    ({"groups": group(hull=(SQUARE * 1e7,))}, "1e.07 in groups.hull"),
    ({"pos": np.zeros((2, 2)).view(np.matrix)}, r"pos of shape \(2, 2\), matrix"),
    ({"id": np.ma.masked_array([1, 2])}, "MaskedArray"), ({"cov": np.zeros((2, 4, 4)).view(np.recarray)}, "recarray"),
    ({"groups": group(hull=(SQUARE.view(np.matrix),))}, "groups.hull"),
    ({"groups": group(members=(np.array([[1, 2]]).view(np.matrix),))}, "groups.members"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "words"), BEYOND)
def test_what_no_file_can_hold_is_the_trackers_fault_at_its_frame(changes, words) -> None:
    with pytest.raises(WorkError, match=words) as caught:
        check_tracks(answer(**changes), 3, "mine.py:Mine", "s")
    assert str(caught.value).startswith("mine.py:Mine: s, frame 3")


def test_the_greatest_numbers_are_stored_and_read(tmp_path: Path) -> None:
    class Far(Stranger):
        def step(self, frame, detections):
            found = super().step(frame, detections)
            if frame.index < 6 or not len(found.id):  # the first answers must fit the detections
                return found
            end = 10**6
            told = event(start=1, end=end, emitted=None, members=(0,), before=(2**63 - 1,), pos=(-1e6, math.nan))
            pos = np.full_like(found.pos, 1e6)
            return found.replace(
                pos=pos, vel=-pos, box=np.full((len(pos), 4), 1e6), groups=Groups.none(), events=(told,)
            )

    read = read_tracks(write_tracks(tmp_path / "run", track(Far(), source()), fps=10.0))
    assert max(t.pos.max() for t in read if len(t.id)) == 1e6
    assert {e.end for t in read for e in t.events} == {10**6}


class Raises:
    @property
    def inner(self):
        raise KeyError("boo")


CYCLE: dict = {}
CYCLE["again"] = CYCLE
DEEP: list = []
for _ in range(40):
    DEEP = [DEEP]
NO_JSON = {
    "nan": {"a": math.nan}, "array": {"a": np.zeros(2)}, "cycle": CYCLE, "deep": DEEP, "set": {1}, "big": {"a": 10**25},
    "scalar": np.int64(3), "bytes": b"x", "key": {(1, 2): 3},
}  # fmt: skip


@pytest.mark.parametrize("name", NO_JSON)
@pytest.mark.parametrize("late", [False, True])
def test_diagnostics_that_are_no_json(name: str, late: bool) -> None:
    class Talks(Stranger):
        def step(self, frame, detections):
            if not late or frame.index == 3:
                self.diagnostics = NO_JSON[name]
            return super().step(frame, detections)

    place = "after the last frame" if late else "frame 1"
    with pytest.raises(WorkError, match=rf"{place}: got diagnostics that are no JSON: .*; expected dicts"):
        track(Talks(), source())


def test_diagnostics_that_raise() -> None:
    class Talks(Stranger):
        diagnostics = property(lambda self: Raises().inner)

    with pytest.raises(WorkError, match=r"frame 1: got KeyError: 'boo'; .*correct the tracker's diagnostics"):
        track(Talks(), source())


def test_diagnostics_are_stored_as_they_are_when_the_run_ends(tmp_path: Path) -> None:
    class Talks(Stranger):
        def step(self, frame, detections):
            self.diagnostics = {"frames": (frame.index, 0.5), 3: None}
            return super().step(frame, detections)

    tracker = Talks()
    found = track(tracker, source())
    tracker.diagnostics["frames"] = np.zeros(2)
    folder = write_tracks(tmp_path / "run", found, fps=10.0, info=found.info)
    stored = json.loads((folder / "run.json").read_text())
    assert stored["diagnostics"] == {"frames": [len(found), 0.5], "3": None}


ENDS = {
    "os._exit(0)": "exit code 0", "os._exit(7)": "exit code 7", "os.kill(os.getpid(), 9)": r"signal 9 .SIGKILL.",
    "os.kill(os.getpid(), 15)": r"signal 15 .SIGTERM.", "__import__('ctypes').CDLL(None).exit(0)": "exit code 0",
}  # fmt: skip


def command(folder: Path, statement: str, *more: str) -> list[str]:
    folder.joinpath("mine.py").write_text(MOVES.format("pass", "open('mark', 'w').close()", statement))
    folder.joinpath("gt.txt").write_text("".join(f"{k},1,10,10,20,50,1,1,1\n" for k in range(1, 9)))
    words = ["track", "mine.py:Mine", "gt.txt", "--fps", "10", "--out", "out", *more]
    return [sys.executable, "-m", "tracking.app.cli", *words]


@pytest.mark.parametrize("statement", ENDS)
def test_a_tracker_that_ends_the_process_is_an_error_that_names_it(tmp_path: Path, statement: str) -> None:
    done = subprocess.run(command(tmp_path, statement), cwd=tmp_path, env=ENV, capture_output=True, text=True)
    assert done.returncode == 1
    assert re.search(rf"error: mine.py:Mine: got the end of the process, with {ENDS[statement]}; ", done.stderr)


def test_the_end_of_the_process_as_json_and_with_a_limit_of_time(tmp_path: Path) -> None:
    line = command(tmp_path, "os._exit(7)", "--json")
    done = subprocess.run(line, cwd=tmp_path, env=ENV, capture_output=True, text=True)
    assert json.loads(done.stdout)["error"]["file"] == "mine.py:Mine"
    line = command(tmp_path, "os.kill(os.getpid(), 9)", "--step-timeout", "60")
    done = subprocess.run(line, cwd=tmp_path, env=ENV, capture_output=True, text=True)
    assert re.search(r"error: mine.py:Mine: gt, frame 1: got .* ended with signal 9", done.stderr)


def test_the_end_of_a_worker_names_the_tracker(tmp_path: Path) -> None:
    line = command(tmp_path, "os._exit(0)", "--workers", "2")
    for name in "ab":
        (tmp_path / "data" / name / "gt").mkdir(parents=True)
        (tmp_path / "data" / name / "gt" / "gt.txt").write_text((tmp_path / "gt.txt").read_text())
    line[line.index("gt.txt")] = "data"
    done = subprocess.run(line, cwd=tmp_path, env=ENV, capture_output=True, text=True)
    assert done.returncode == 1
    assert re.search(r"error: mine.py:Mine: [ab]: got an item that killed 3 workers, .* exit code 0", done.stderr)


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, -15), (signal.SIGKILL, -9)])
def test_signals_to_the_command_reach_the_process_of_the_tracker(tmp_path: Path, number: int, code: int) -> None:
    waits = "Path('pid').write_text(str(os.getpid())); __import__('time').sleep(60)"
    with subprocess.Popen(command(tmp_path, waits), cwd=tmp_path, env=ENV, stderr=subprocess.PIPE) as process:
        while not (tmp_path / "pid").exists() or not (tmp_path / "pid").read_text():
            assert process.poll() is None
            time.sleep(0.05)
        process.send_signal(number)
        assert process.wait(30) == code
    child = int((tmp_path / "pid").read_text())
    assert child != process.pid
    for _ in range(200):
        if not Path(f"/proc/{child}").exists():
            return
        time.sleep(0.05)
    raise AssertionError("the child is still there")


def test_a_command_that_ends_by_itself_has_its_own_exit_code(tmp_path: Path) -> None:
    for statement, code in (("pass", 0), ("1 / 0", 1)):
        done = subprocess.run(command(tmp_path, statement), cwd=tmp_path, env=ENV, capture_output=True, text=True)
        assert done.returncode == code
        assert "end of the process" not in done.stderr


MOVES = """
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
import numpy as np
from tests.tracking.running.test_run import Stranger
{0}
class Mine(Stranger):
    def reset(self, context, seed):
        super().reset(context, seed)
        {1}
    def step(self, frame, detections):
        if frame.index > 1:
            assert Path("mark").exists(), os.getcwd()
        {2}
        return super().step(frame, detections)
"""


@pytest.mark.parametrize("where", range(3))
@pytest.mark.parametrize("limit", [(), ("--step-timeout", "60")])
def test_a_tracker_that_changes_the_working_folder_keeps_it_to_itself(
    tmp_path: Path, monkeypatch, where: int, limit: tuple[str, ...]
) -> None:
    """Its run was written there, and success printed."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "else").mkdir()
    (tmp_path / "else" / "mark").touch()
    parts = ["pass" if k != where else f"os.chdir({str(tmp_path / 'else')!r})" for k in range(3)]
    (tmp_path / "mine.py").write_text(MOVES.format(*parts))
    Path("gt.txt").write_text("".join(f"{k},1,10,10,20,50,1,1,1\n" for k in range(1, 9)))
    assert run(["track", "mine.py:Mine", "gt.txt", "--fps", "10", "--out", "out", *limit]) == 0
    assert Path.cwd() == tmp_path
    assert (tmp_path / "out" / "run.json").exists()
    assert os.listdir("else") == ["mark"]
