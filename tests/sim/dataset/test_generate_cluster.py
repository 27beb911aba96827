"""A dataset made on a cluster has the bytes of one made here, though workers die; nothing is lost or left over."""

from __future__ import annotations

import importlib.util
import os
import sys
import types
from collections.abc import Iterator
from pathlib import Path

import pytest

from scenarios.errors import InputError
from scenarios.loading.resolve import Entry
from scenarios.schema.scenario import Scenario
from sim.dataset import generate as generating
from sim.dataset.generate import generate
from sim.workers.start import WorkerOptions
from tests.loopback import Loopback, loopback

pytestmark = pytest.mark.slow

FAKES = Path(__file__).resolve().parents[1] / "io" / "conftest.py"
SCENARIO = Scenario.model_validate({"schema": 1, "group": [{"id": "a", "start": [1, 1], "goal": [2, 2]}]})
ENTRIES = [Entry("x", SCENARIO), Entry("y-1", SCENARIO, 1)]

# What a worker is told first: a fake simulator; who makes seed 1 first dies, and who has written seed 3 first, before
# it takes its place.
PRELOAD = f"""
import importlib.util, os, signal, sys, types
from pathlib import Path
FOLDER = Path("FOLDER")
spec = importlib.util.spec_from_file_location("fakes", {str(FAKES)!r})
fakes = importlib.util.module_from_spec(spec)
spec.loader.exec_module(fakes)

def die_once(name):
    try:
        (FOLDER / name).touch(exist_ok=False)
    except FileExistsError:
        return
    os.kill(os.getpid(), signal.SIGKILL)

def simulate(scenario, seed, repeat, streams=(), stride=1):
    if seed == 1 and (FOLDER / "deadly").exists():
        die_once("made")
    return fakes.sequence(seed + 100 * repeat)

rename = getattr(os.rename, "real", os.rename)

def rename_or_die(source, target):
    if "-s00003" in str(target) and (FOLDER / "deadly").exists():
        die_once("written")
    rename(source, target)

rename_or_die.real = rename
os.rename = rename_or_die
sys.modules["sim.sequence"] = types.SimpleNamespace(simulate=simulate, observe=None)
"""


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Loopback]:
    """Four workers, of which the deadly scenes cost two."""
    pytest.importorskip("distributed", reason="the extra [cluster] is not installed")
    folder = tmp_path_factory.mktemp("cluster")
    (folder / "preload.py").write_text(PRELOAD.replace('FOLDER")', f'{folder}")'))
    with loopback(folder, 4, "--preload", str(folder / "preload.py")) as cluster:
        yield cluster


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, bytes]:
    """What this process makes."""
    spec = importlib.util.spec_from_file_location("fakes", FAKES)
    fakes = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(fakes)
    fake = types.SimpleNamespace(simulate=lambda s, seed, repeat, *_: fakes.sequence(seed + 100 * repeat))
    monkeypatch.setitem(sys.modules, "sim.sequence", fake)
    generate(ENTRIES, range(6), tmp_path / "here", streams=())
    return content(tmp_path / "here")


def content(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_the_same_bytes(tmp_path: Path, cluster: Loopback, here: dict[str, bytes], monkeypatch) -> None:
    """A path that is relative here is meant here."""
    monkeypatch.chdir(tmp_path)
    seen = []
    made = generate(
        ENTRIES, range(6), "there", streams=(), workers=WorkerOptions(cluster=cluster.address),
        progress=lambda *a: seen.append(a[:2]),
    )  # fmt: skip
    assert made[0] == tmp_path / "there/flockscope-train/x-s00000"
    assert seen == [(k, 12) for k in range(1, 13)]
    assert content(tmp_path / "there") == here


def test_nothing_is_left_of_a_folder_that_no_worker_sees(tmp_path: Path, cluster: Loopback, monkeypatch) -> None:
    """The mark is taken away as soon as it is there: so a machine of another file system would find it."""
    monkeypatch.setattr(generating, "write_file", lambda path, body: None)
    with pytest.raises(InputError, match=f"{tmp_path}/there: on .*: got another folder, or none"):
        generate(ENTRIES, range(2), tmp_path / "there", streams=(), workers=WorkerOptions(cluster=cluster.address))
    assert os.listdir(tmp_path) == []
