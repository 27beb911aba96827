"""A dask cluster of processes on loopback works like processes of our own; who cannot take part is told in one line."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from scenarios.errors import InputError, WorkError
from sim.workers import cluster
from sim.workers.start import start_workers
from tests.errands import complain, fall, process, profiled, refuse, root_of
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


def test_an_error_there_is_raised_here(two: Loopback) -> None:
    with pytest.raises(ValueError, match="-1 is negative") as caught, start_workers(1, two.address) as run:
        list(run(refuse, [1, -1]))
    assert "errands.py" in str(caught.value.__cause__)
    with pytest.raises(RuntimeError, match="Awkward: ab"), start_workers(1, two.address) as run:
        list(run(complain, [0]))


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


@pytest.mark.parametrize(
    "address", ["", "127.0.0.1:8786", "tcp://host", "tcp://:1", "host", "tcp://a b:1", "tcp://::1:8786"]
)
def test_what_is_no_address(address: str) -> None:
    with pytest.raises(InputError, match=r"--cluster: got .*; expected tcp://HOST:PORT"), start_workers(1, address):
        pass


def test_without_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r'-e "\.\[cluster\]"'), start_workers(1, "tcp://127.0.0.1:1"):
        pass
