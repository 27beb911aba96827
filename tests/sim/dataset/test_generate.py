import json
import signal
import subprocess
from pathlib import Path

import pytest

from scenarios.errors import InputError, WorkError
from scenarios.loading.resolve import Entry
from sim.dataset.generate import generate
from sim.dataset.splits import split_of
from sim.store import atomic
from sim.store.seal import with_hash
from sim.store.validate import validate
from sim.workers.start import WorkerOptions
from tests.fake_simulator import content, scenario
from tests.processes import python
from tests.small_disks import small_disk
from tracking.recordings.source import open_source

# A program of its own: simulate is a fake, in its workers too; argument 1 the folder, 2 workers, 3 what goes wrong.
PROGRAM = """
import os, signal, sys, types
from tests import fake_simulator as fakes

def simulate(scenario, seed, repeat, streams=(), stride=1):
    return fakes.make_sequence(seed + 100 * repeat)

sys.modules["sim.sequence"] = types.SimpleNamespace(simulate=simulate, observe=None)
from scenarios.loading.resolve import Entry
from scenarios.schema.scenario import Scenario
from sim.dataset.generate import generate
from sim.store import atomic
from sim.workers.start import WorkerOptions

if __name__ == "__main__":
    out, workers, kill_after = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    count = 0
    write = atomic.write_inside

    def die(path, body):
        global count
        count += 1
        if count == kill_after:
            os.kill(os.getpid(), signal.SIGKILL)
        write(path, body)

    atomic.write_inside = die
    scenario = Scenario.model_validate({"schema": 1, "group": [{"id": "a", "start": [1, 1], "goal": [2, 2]}]})
    entries = [Entry("x", scenario, 0), Entry("y-1", scenario, 1)]
    generate(entries, range(3), out, workers=WorkerOptions(workers), streams=())
"""


def run_program(tmp_path, out, workers, kill_after=0):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    return python(program, out, workers, kill_after)


def test_layout_seqmap_and_reading(tmp_path, simulate):
    seen = []
    entries = [Entry("b", scenario()), Entry("a-2", scenario(), 2)]
    made = generate(entries, range(20_000, 20_002), tmp_path, progress=lambda *a: seen.append(a))
    names = ["b-s20000", "b-s20001", "a-2-s20000", "a-2-s20001"]
    assert [p.name for p in made] == names
    assert {p.parent for p in made} == {tmp_path / "flockscope-test"}
    assert (tmp_path / "seqmaps/flockscope-test.txt").read_text().split() == ["name", *sorted(names)]
    assert [(done, total) for done, total, _ in seen] == [(1, 4), (2, 4), (3, 4), (4, 4)]
    assert [s.name for s in open_source(tmp_path)] == sorted(names)
    assert [s.name for s in open_source(tmp_path / "flockscope-test")] == sorted(names)
    assert open_source(made[2])[0].source["repeat"] == 2
    assert validate(tmp_path) == validate(tmp_path / "flockscope-test") == validate(made[0]) == []


def test_complete_sequences_are_kept_and_others_redone(tmp_path, simulate):
    made = generate([Entry("x", scenario())], range(3), tmp_path)
    before = content(tmp_path)
    (made[0] / "gt/gt.txt").write_text("1,1,0,0,1,1,1,1,1\n")
    (made[1] / "manifest.json").unlink()
    (tmp_path / "flockscope-train" / ".partial-x-s00001-0123456789ab").mkdir()
    (tmp_path / "flockscope-train" / ".partial-x-s00002-0123456789ab").mkdir()
    (tmp_path / "seqmaps" / ".partial-flockscope-train.txt-0123456789ab").write_text("name")
    simulate.asked.clear()
    generate([Entry("x", scenario())], range(3), tmp_path)
    assert simulate.made == [0, 1]
    assert content(tmp_path) == before


@pytest.mark.parametrize("harm", ["cut off", "another format", "altered", "a wrong value"])
def test_a_sequence_with_an_invalid_manifest_is_not_replaced(tmp_path, simulate, harm):
    """Nobody knows what it holds: perhaps another scenario, or a sequence of another version."""
    (folder,) = generate([Entry("x", scenario())], range(1), tmp_path)
    path = folder / "manifest.json"
    manifest = json.loads(path.read_text())
    changed = {"another format": {"format": 9}, "a wrong value": {"streams": 5}}.get(harm, {"seed": 7})
    body = json.dumps({**manifest, **changed} if harm == "altered" else with_hash({**manifest, **changed}))
    path.write_text(body[:200] if harm == "cut off" else body)
    before = content(tmp_path)
    simulate.asked.clear()
    with pytest.raises(InputError, match=r"manifest.json.*delete that folder"):
        generate([Entry("x", scenario())], range(2), tmp_path)
    assert content(tmp_path) == before
    assert simulate.made == []


def test_another_scenario_is_not_overwritten(tmp_path, simulate):
    generate([Entry("x", scenario())], range(1), tmp_path)
    before = content(tmp_path)
    with pytest.raises(InputError, match=r"a sequence of scenario \w{8};"):
        generate([Entry("x", scenario(duration=3.0))], range(2), tmp_path)
    with pytest.raises(InputError, match="repeat"):
        generate([Entry("x", scenario(), 1)], range(2), tmp_path)
    assert content(tmp_path) == before


@pytest.mark.parametrize(
    ("seeds", "split"),
    [((0, 10_000), "train"), ((10_000, 10_001), "val"), ((29_999, 30_000), "test"), ((30_000, 40_000), "fit"),
     ((40_000, 99_999), "demo")],
)  # fmt: skip
def test_splits(seeds, split):
    assert split_of(range(*seeds)) == split


def test_wrong_requests_make_nothing(tmp_path, simulate):
    x = Entry("x", scenario())
    for entries, more, word in (([x, x], {}, "twice"), ([x], {"workers": WorkerOptions(0)}, "workers")):
        with pytest.raises(InputError, match=word):
            generate(entries, range(2), tmp_path / "new", **more)
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="--out"):
        generate([x], range(2), tmp_path / "file" / "new")
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize(
    "error", [WorkError(got="m1 at 3.0 m", expected="1.5 m", remedy="bring them nearer"), KeyError("k")]
)
def test_one_failure_is_named_and_the_others_kept(tmp_path, simulate, error):
    simulate.wrong = {1: error}
    with pytest.raises(WorkError) as caught:
        generate([Entry("x", scenario())], range(3), tmp_path)
    assert caught.value.file == "x-s00001"
    assert sorted(p.name for p in (tmp_path / "flockscope-train").iterdir()) == ["x-s00000", "x-s00002"]
    assert validate(tmp_path) == []
    simulate.wrong = {0: error, 1: error, 2: error}
    with pytest.raises(WorkError, match="2 more of 3"):
        generate([Entry("z", scenario())], range(3), tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_one_run_at_a_time(tmp_path, simulate):
    found = []

    def second(*_):
        with pytest.raises(InputError, match="another run") as error:
            generate([Entry("x", scenario())], range(1), tmp_path)
        found.append(error)

    generate([Entry("x", scenario())], range(1), tmp_path, progress=second)
    assert len(found) == 1


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """What the program makes when nobody disturbs it."""
    folder = tmp_path_factory.mktemp("whole")
    done = run_program(folder, folder / "out", 1)
    assert done.returncode == 0, done.stderr
    return content(folder / "out")


def test_two_workers_make_the_same_bytes(tmp_path, whole):
    done = run_program(tmp_path, tmp_path / "out", 2)
    assert done.returncode == 0, done.stderr
    assert content(tmp_path / "out") == whole
    assert validate(tmp_path / "out") == []


@pytest.mark.slow
@pytest.mark.parametrize("kill_after", [1, 14, 20, 33])
def test_killed_in_the_middle_and_resumed(tmp_path, whole, kill_after):
    assert run_program(tmp_path, tmp_path / "out", 1, kill_after).returncode == -signal.SIGKILL
    assert [p for p in open_all(tmp_path / "out") if not (p / "manifest.json").is_file()] == []
    assert run_program(tmp_path, tmp_path / "out", 1).returncode == 0
    assert content(tmp_path / "out") == whole


@pytest.mark.slow
def test_a_disk_fills_up_under_two_workers(tmp_path, whole):
    with small_disk(tmp_path / "disk", "size=64k") as folder:
        done = run_program(tmp_path, folder / "out", 2)
        assert done.returncode == 1
        assert "No space left" in done.stderr.splitlines()[-1]
        there = open_all(folder / "out")
        assert len(there) < 6
        assert all(validate(p) == [] for p in there)
        assert list(folder.rglob(f"{atomic.PARTIAL}*")) == []
        subprocess.run(["mount", "-o", "remount,size=10m", folder], check=True)
        assert run_program(tmp_path, folder / "out", 2).returncode == 0
        assert content(folder / "out") == whole


def open_all(out: Path) -> list[Path]:
    return [p for p in out.glob("flockscope-train/*/") if not p.name.startswith(".")]


def test_suites_with_entries_of_one_name_are_refused_with_a_remedy(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"'pillar' twice.*combine them in a suite"):
        generate(["standard", "occlusion"], range(1), tmp_path, streams=())
