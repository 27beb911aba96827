"""A dask cluster of processes on loopback works like processes of our own; who cannot take part is told in one line."""

from __future__ import annotations

import os
import re
import signal
import sys
import threading
import time
import warnings
from collections.abc import Iterator
from pathlib import Path

import pytest

from scenarios.errors import InputError, WorkError
from sim import hashing as versions
from sim.workers import cluster
from sim.workers.start import start_workers
from tests.errands import complain, fall, process, profiled, refuse, root_of, tell_and_wait
from tests.loopback import Loopback, loopback

pytestmark = pytest.mark.slow

pytest.importorskip("distributed", reason="the extra [cluster] is not installed")


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Loopback]:
    """Two workers that nobody ends."""
    with loopback(tmp_path_factory.mktemp("two")) as cluster:
        yield cluster


@pytest.fixture(scope="module")
def strict(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Loopback]:
    """A scheduler that gives up an item with the first worker that dies at it; no workers yet."""
    env = {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "0"}
    with loopback(tmp_path_factory.mktemp("strict"), 0, **env) as cluster:
        yield cluster


def test_every_item_with_its_result(two: Loopback) -> None:
    with start_workers(1, two.address) as run:
        assert sorted(run(root_of, [9.0, 4.0, 16.0])) == [(4.0, 2.0), (9.0, 3.0), (16.0, 4.0)]
        assert list(run(root_of, [])) == []
        who = dict(run(process, range(20), ahead=20))
    assert set(who) == set(range(20))
    assert set(who.values()) <= {worker.pid for worker in two.workers}


def test_items_are_taken_when_there_is_somebody_to_do_them(two: Loopback) -> None:
    taken, seen = [], []

    def items() -> Iterator[int]:
        for k in range(12):
            assert len(taken) - len(seen) < 2 + 1
            taken.append(k)
            yield k

    with start_workers(1, two.address) as run:
        for k, _ in run(process, items(), ahead=1):
            seen.append(k)
    assert sorted(seen) == list(range(12))


def test_an_error_there_is_raised_here(two: Loopback) -> None:
    with pytest.raises(ValueError, match="-1 is negative") as caught, start_workers(1, two.address) as run:
        list(run(refuse, [1, -1]))
    assert "errands.py" in str(caught.value.__cause__)
    with pytest.raises(RuntimeError, match="Awkward: ab"), start_workers(1, two.address) as run:
        list(run(complain, [0]))


def test_the_work_of_a_killed_worker_is_done_by_another(tmp_path: Path) -> None:
    """Both are at an item; one is killed; the other is let go on, and does both."""
    with loopback(tmp_path) as cluster, start_workers(1, cluster.address) as run:
        pids = {worker.pid for worker in cluster.workers}
        assert {pid for _, pid in run(process, range(8), ahead=8)} <= pids
        markers = [tmp_path / "a", tmp_path / "b"]
        pairs = run(tell_and_wait, kill_one(markers, cluster))
        assert sorted(pairs) == [(m, m.name) for m in markers]
        survivor = {worker.pid for worker in cluster.workers if worker.poll() is None}
        assert {int(m.read_text()) for m in markers} == survivor


def kill_one(markers: list[Path], cluster: Loopback) -> Iterator[Path]:
    """The items; who has written the first is killed with the second under way, and then both may end."""

    def kill() -> None:
        while not all(m.exists() and m.read_text() for m in markers):
            time.sleep(0.01)
        os.kill(int(markers[0].read_text()), signal.SIGKILL)
        next(w for w in cluster.workers if w.pid == int(markers[0].read_text())).wait()
        for m in markers:
            m.with_suffix(".go").write_text("")

    threading.Thread(target=kill, daemon=True).start()
    yield from markers


def test_an_item_that_kills_its_workers_is_one_clear_error_or_has_a_result(strict: Loopback) -> None:
    strict.add_worker()
    with start_workers(1, strict.address) as run:
        found = []
        for item, result in run(fall, iter([2, 1]), on_loss=lambda item, error: str(error)):
            found.append((item, result))
        assert found[0] == (2, 2)
        assert found[1][1].startswith("got an item that killed 1 workers, the last by the loss of tcp://127.0.0.1:")
        strict.add_worker()
        with pytest.raises(WorkError, match="item that killed"):
            list(run(fall, [1]))


@pytest.mark.parametrize(
    ("empty", "message"),
    [(False, "tcp://127.0.0.1:.*: got a worker of 2 threads; expected one thread per worker"),
     (True, "got a worker that cannot import flockscope .*No module named 'sim.workers'; 'sim' is not a package")],
)  # fmt: skip
def test_a_worker_that_cannot_take_part(empty: bool, message: str, strict: Loopback, tmp_path: Path) -> None:
    (tmp_path / "empty.py").write_text("import sys, types\nsys.modules['sim'] = types.ModuleType('sim')\n")
    worker = strict.add_worker("--preload", str(tmp_path / "empty.py")) if empty else strict.add_worker(threads=2)
    try:
        with pytest.raises(WorkError, match=message), start_workers(1, strict.address) as run:
            list(run(root_of, [4.0]))
    finally:
        worker.kill()
        worker.wait()


@pytest.mark.parametrize("name", ["numpy", "flockscope", "sources"])
def test_a_worker_that_is_not_as_we_are(name: str, two: Loopback, monkeypatch: pytest.MonkeyPatch) -> None:
    other = {**cluster.runtime(), name: "another"}
    monkeypatch.setattr(cluster, "runtime", lambda: other)
    message = (
        f"tcp://127.0.0.1:.*: got a worker with {name} .*; expected {name} another as here; .*install the same on all"
    )
    with pytest.raises(WorkError, match=message), start_workers(1, two.address) as run:
        list(run(root_of, [4.0]))


def test_sources_are_told_apart_by_every_byte_and_name(tmp_path: Path) -> None:
    for package in versions.packages():
        (tmp_path / package).mkdir()
    file = tmp_path / "sim" / "a.py"
    found = [versions.source_hash(tmp_path)]
    for change in (lambda: file.write_text("1"), lambda: file.write_text("2"),
                   lambda: file.rename(tmp_path / "scenarios" / "a.toml")):  # fmt: skip
        change()
        found.append(versions.source_hash(tmp_path))
    assert len(set(found)) == 4
    (tmp_path / "sim" / "a.pyc").write_text("")
    assert versions.source_hash(tmp_path) == found[-1]


@pytest.mark.skipif(sys.version_info >= cluster.PROFILE_SAFE, reason="this Python does not stand still")
def test_workers_do_without_the_profile_that_may_stop_them(two: Loopback) -> None:
    with start_workers(1, two.address) as run:
        assert set(dict(run(profiled, range(8), ahead=8)).values()) == {False}


def test_a_scheduler_that_goes_away(tmp_path: Path) -> None:
    with loopback(tmp_path, 1) as here, start_workers(1, here.address) as run:
        pairs = run(process, range(1000))
        next(pairs)
        here.scheduler.kill()
        for some in (pairs, run(process, range(3)), run(process, range(3))):  # lost, and known to be lost
            with pytest.raises(WorkError, match=f"lost connection to {here.address}.*is kept"):
                list(some)
            time.sleep(1.0)


def test_nobody_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "CONNECT_TIMEOUT", 0.2)
    with pytest.raises(WorkError, match=r"no answer from tcp://127\.0\.0\.1:1 "), start_workers(1, "tcp://127.0.0.1:1"):
        pass


def test_a_scheduler_without_workers_is_told_once(strict: Loopback, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "NO_WORKERS_WARNING", 0.0)
    monkeypatch.setattr(cluster, "COUNT_INTERVAL", 0.05)
    with start_workers(1, strict.address) as run, warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        pairs = run(process, iter([0]))
        strict.add_worker()
        assert len(list(pairs)) == 1
    assert ["has no workers: waiting" in str(w.message) for w in told] == [True]


@pytest.mark.parametrize(
    "address", ["", "127.0.0.1:8786", "tcp://host", "tcp://:1", "host", "tcp://a b:1", "tcp://::1:8786"]
)
def test_what_is_no_address(address: str) -> None:
    with pytest.raises(InputError, match=r"--cluster: got .*; expected tcp://HOST:PORT"), start_workers(1, address):
        pass


@pytest.mark.parametrize("address", ["tcp://host:8786", "tls://10.0.0.7:1", "tcp://[::1]:8786", "tcp://a.b-c.de:80/"])
def test_what_is_an_address(address: str) -> None:
    assert re.fullmatch(cluster.ADDRESS, address)


def test_without_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"flockscope\[cluster\]"), start_workers(1, "tcp://127.0.0.1:1"):
        pass
