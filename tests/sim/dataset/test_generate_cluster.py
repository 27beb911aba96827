"""A dataset made on a cluster has the bytes of one made here; the folder must be shared."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from scenarios.errors import InputError
from sim.dataset import generate as generating
from sim.dataset.generate import generate
from sim.workers.start import WorkerOptions
from tests.fake_simulator import content
from tests.loopback import Loopback, loopback

pytestmark = pytest.mark.slow

SHORT = {"set": ["duration=2", "event=[]", "camera.fps=5"], "streams": ()}


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Loopback]:
    pytest.importorskip("distributed", reason="the extra [cluster] is not installed")
    with loopback(tmp_path_factory.mktemp("cluster")) as cluster:
        yield cluster


@pytest.mark.parametrize(
    ("pack", "first", "count"),
    [(False, "merge-s00000", 6), (True, "merge/merge-s00000.tar", 2)],
    ids=["folders", "shards"],
)
def test_the_same_bytes(
    tmp_path: Path, cluster: Loopback, monkeypatch: pytest.MonkeyPatch, pack: bool, first: str, count: int
) -> None:
    """A path that is relative here is meant here."""
    monkeypatch.chdir(tmp_path)
    seen = []
    generate(["merge", "cross"], range(3), tmp_path / "here", pack=pack, **SHORT)
    made = generate(
        ["merge", "cross"], range(3), "there", workers=WorkerOptions(cluster=cluster.address),
        progress=lambda *a: seen.append(a[:2]), pack=pack, **SHORT,
    )  # fmt: skip
    assert made[0] == tmp_path / "there/flockscope-train" / first
    assert seen == [(k, count) for k in range(1, count + 1)]
    assert content(tmp_path / "there") == content(tmp_path / "here")


def test_nothing_is_left_of_a_folder_that_no_worker_sees(tmp_path: Path, cluster: Loopback, monkeypatch) -> None:
    """The mark is never there, as on a machine of another file system."""
    monkeypatch.setattr(generating, "write_file", lambda path, body: None)
    with pytest.raises(InputError, match=f"{tmp_path}/there: on .*: got another folder, or none"):
        generate(["merge"], range(2), tmp_path / "there", workers=WorkerOptions(cluster=cluster.address), **SHORT)
    assert list(tmp_path.iterdir()) == []
