"""`flockscope track` on lines of boxes and on live pictures: what goes in and comes out, and how a run ends."""

from __future__ import annotations

import io
import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from sim.store.seal import RUN, check_run
from sim.store.track_files import read_run
from tests.processes import FAKE, ROOT
from tests.streams import sent
from tracking.app.cli import run
from tracking.recordings import live_source

COUNT = 60
PATIENCE = 60.0  # s until a process must have read what it was sent


def lines(count=COUNT, first=1):
    """People who walk side by side, and one alone, on the ground."""
    for k in range(first, first + count):
        x = 0.1 * k
        yield json.dumps({"frame": k, "points": [[x, 2.0], [x, 2.6], [20 - x, 7.0]]}) + "\n"


def given(monkeypatch, text):
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text.encode())))


def track(monkeypatch, capsys, out, text, *words):
    """The exit code, the JSON lines on stdout, and stderr."""
    given(monkeypatch, text)
    code = run(["track", FAKE, "-", "--out", str(out), "--fps", "10", *words])
    printed = capsys.readouterr()
    return code, [json.loads(line) for line in printed.out.splitlines() if line.startswith("{")], printed.err


def test_lines_in_and_lines_out(tmp_path, monkeypatch, capsys):
    code, rows, _ = track(monkeypatch, capsys, tmp_path / "run", "".join(lines()), "--stream")
    assert code == 0
    assert [row["frame"] for row in rows] == list(range(1, COUNT + 1))
    stored = read_run(tmp_path / "run")
    for row, tracks in zip(rows, stored, strict=True):
        assert [person["id"] for person in row["people"]] == tracks.id.tolist()
        assert row["counts"] == {"people": len(tracks.id), "groups": len(tracks.groups.id)}
        np.testing.assert_array_equal([person["pos"] for person in row["people"]], tracks.pos.reshape(-1, 2))
    assert rows[-1]["counts"] == {"people": 3, "groups": 1}
    assert len(rows[-1]["groups"][0]["members"]) == 2


def test_run_json_says_how_the_run_went(tmp_path, monkeypatch, capsys):
    some = [line for k, line in enumerate(lines(), 1) if k not in (20, 21, 22)]
    code, rows, _ = track(monkeypatch, capsys, tmp_path / "run", "".join(some), "--json")
    assert code == 0
    info = check_run(tmp_path / "run")
    assert info["live"]
    assert info["ended"] == "ended"
    assert (info["frames"], info["lost_frames"], info["unobserved"]) == (COUNT, 3, [[20, 22]])
    assert info["latency_ms"]["frames"] == COUNT - 3
    assert 0 < info["latency_ms"]["median"] <= info["latency_ms"]["99 %"]
    assert rows[0]["status"] == "ok"
    assert rows[0]["runs"][0]["lost_frames"] == 3


def test_a_wrong_line_keeps_what_came_before(tmp_path, monkeypatch, capsys):
    code, rows, _ = track(monkeypatch, capsys, tmp_path / "run", "".join(lines(20)) + "oops\n", "--json")
    assert code == 2
    assert rows[-1]["error"]["place"] == "line 21"
    assert check_run(tmp_path / "run")["ended"] == "lost"
    assert len(read_run(tmp_path / "run")) == 20


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('{"frame": 0, "points": []}', "a frame from 1"), ('{"frame": 5, "t": 1, "points": []}', "t and frame"),
        ('{"frame": 3, "points": []}', "0.3 s or later"), ('{"t": 1.7e12, "points": []}', "divide milliseconds by"),
        ('{"points": [[1, null]]}', "NaN"), ('{"points": [[1, "a"]]}', "points"),
    ],
)  # fmt: skip
def test_a_frame_that_cannot_be_is_named_with_its_line(tmp_path, monkeypatch, capsys, line, words):
    code, _, err = track(monkeypatch, capsys, tmp_path / "run", "".join(lines(3)) + line + "\n")
    assert code == 2
    assert words in err
    assert "line 4" in err
    assert len(read_run(tmp_path / "run")) == 3


def test_nothing_comes_in(tmp_path, monkeypatch, capsys):
    code, _, _ = track(monkeypatch, capsys, tmp_path / "run", "")
    assert code == 0
    assert not (tmp_path / "run").exists() or not (tmp_path / "run" / RUN).exists()


@pytest.mark.parametrize("words", [["--when-slow", "drop"], ["--follow", "3"], ["--detections", "file"]])
def test_an_option_without_effect_is_refused(tmp_path, monkeypatch, capsys, words):
    code, _, err = track(monkeypatch, capsys, tmp_path / "run", "".join(lines(3)), *words)
    assert code == 2
    assert f"leave {words[0]} out" in err


def test_an_option_of_live_runs_is_refused_for_a_recording(tmp_path, capsys):
    (tmp_path / "det.txt").write_text("1,-1,1,1,9,20,1\n")
    for words in (["--stream"], ["--when-slow", "wait"]):
        assert run(["track", "blob", str(tmp_path / "det.txt"), "--out", str(tmp_path / "run"), *words]) == 2
        assert f"leave {words[0]} out" in capsys.readouterr().err


def test_a_file_that_grows_is_tracked(tmp_path, capsys):
    (tmp_path / "video.ts").write_bytes(sent(range(60)))
    words = ["--follow", "0.2", "--px-per-m", "20", "--background", "learn:10", "--json"]
    assert run(["track", "blob", str(tmp_path / "video.ts"), "--out", str(tmp_path / "run"), *words]) == 0
    (row,) = json.loads(capsys.readouterr().out)["runs"]
    assert (row["frames"], row["dropped_pictures"], row["lost_frames"], row["reconnects"]) == (60, 0, 0, 0)
    assert check_run(tmp_path / "run")["background"] == "learned in the first 10 frames"


class Lost:
    """A stream that is lost after 30 pictures."""

    lasts, fps = True, 25.0

    def pictures(self):
        from scenarios.errors import WorkError
        from tests.streams import picture

        for k in range(30):
            yield k / 25, picture(k)
        raise WorkError(file="rtsp://a", got="no answer", expected="a stream", remedy="check it")

    def stop(self):
        pass

    close = stop


def test_a_lost_stream_keeps_all(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(live_source.LivePictures, "_opened", lambda _: Lost())
    monkeypatch.setattr(live_source, "AGAIN", 0.0)
    monkeypatch.setattr(live_source, "PAUSE", 0.0)
    words = ["--background", "learn:10", "--px-per-m", "20", "--when-slow", "wait"]
    assert run(["track", "blob", "rtsp://a", "--out", str(tmp_path / "run"), *words]) == 1, capsys.readouterr()
    assert "30 frames that were tracked before are in" in (err := capsys.readouterr().err), err
    info = check_run(tmp_path / "run")
    assert (info["ended"], info["frames"]) == ("lost", 30)


class Process:
    """The command as a process, which is sent lines and says with --stream what it has tracked."""

    def __init__(self, out):
        words = ["-m", "tracking.app.cli", "track", "group-pda", "-", "--out", str(out), "--fps", "10", "--stream"]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])}
        self.process = subprocess.Popen(
            [sys.executable, *words], cwd=ROOT, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, text=True,
        )  # fmt: skip

    def send(self, first, count):
        for line in lines(count, first):
            self.process.stdin.write(line)
            self.process.stdin.flush()
            assert self.process.stdout.readline()

    def end(self, kind):
        self.process.send_signal(kind)
        self.process.communicate(timeout=PATIENCE)
        return self.process.returncode


@pytest.mark.slow
@pytest.mark.parametrize("kind", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_keeps_all(tmp_path, kind):
    """Also while the command waits for the next line."""
    process = Process(tmp_path / "run")
    process.send(1, 30)
    assert process.end(kind) == 130
    info = check_run(tmp_path / "run")
    assert (info["ended"], info["frames"]) == ("stopped", 30)


@pytest.mark.slow
def test_a_killed_run_is_read_by_all_commands(tmp_path, capsys):
    out, process = tmp_path / "run", Process(tmp_path / "run")
    begun = time.monotonic()
    process.send(1, 1)
    while time.monotonic() - begun < 60 and not list(out.glob("parts/0*/run.json")):
        time.sleep(0.2)
        process.send(2 + round(10 * (time.monotonic() - begun)), 1)
    process.end(signal.SIGKILL)
    assert not (out / RUN).exists()
    assert run(["export", "csv", str(out), "--out", str(tmp_path / "csv")]) == 0
    assert "its run was killed" in capsys.readouterr().err
    assert check_run(out)["ended"] == "killed"
    assert len(read_run(out)) == check_run(out)["frames"]
    assert run(["export", "trajnet", str(out), "--out", str(tmp_path / "net")]) == 0
    capsys.readouterr()


@pytest.mark.slow
def test_a_killed_run_below_a_folder_is_put_together(tmp_path, capsys):
    process = Process(tmp_path / "all" / "one")
    begun, k = time.monotonic(), 1
    while time.monotonic() - begun < 60 and not list(tmp_path.glob("all/one/parts/0*/run.json")):
        process.send(k, 1)
        k += 1
        time.sleep(0.1)
    process.end(signal.SIGKILL)
    assert run(["export", "csv", str(tmp_path / "all"), "--out", str(tmp_path / "csv")]) == 0
    assert "its run was killed" in capsys.readouterr().err
    assert not (tmp_path / "all" / "one" / "parts").exists()
