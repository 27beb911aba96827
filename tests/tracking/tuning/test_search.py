"""The whole search on a toy: it finds what is known to be wrong, the same every time, whoever is killed at it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from scenarios.errors import FlockscopeError, InputError
from tests.processes import ROOT
from tests.toy_tracker import Toy, ToyConfig
from tests.tuning_toys import TOY, toy_plan, tune_arguments
from tracking.tuning.episode_player import episode_player
from tracking.tuning.search import tune
from tracking.tuning.study import LEFT_OUT, open_study, run_trials

KILLED_AT = """
import os, signal, sys
from pathlib import Path
import tracking.tuning.episode_player as work
from tests.tuning_toys import toy_plan, tune_arguments
from tracking.tuning.search import tune
played, attempt = 0, work.stepped
def counted(*given):
    global played
    played += 1
    if played == int(sys.argv[2]):
        os.kill(os.getpid(), signal.SIGKILL)
    return attempt(*given)
work.stepped = counted
folder = Path(sys.argv[1])
tune(**tune_arguments(folder), out=folder / sys.argv[3], storage=sys.argv[4], study="toy")
"""


def in_another_process(folder: Path, at: int, out: str = "toy.toml", storage: str = "") -> subprocess.Popen:
    """The search, killed at its episode number `at`."""
    line = [sys.executable, "-c", KILLED_AT, str(folder), str(at), out, storage or str(folder / "study.journal")]
    return subprocess.Popen(line, cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)})


def contents(folder: Path) -> dict[str, bytes]:
    return {p.name: p.read_bytes() for p in folder.glob("toy.*") if "journal" not in p.name}


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("found")
    return tune(**tune_arguments(folder), out=folder / "toy.toml"), folder


def test_it_finds_what_is_wrong(found):
    """People go a quarter of a metre between frames: a shorter reach loses everybody, nobody need be left out."""
    config = found[0].config
    assert isinstance(config.reach, float)
    assert config.reach > 0.25
    assert config.skip == 0
    assert config.forbidden <= 0.5
    gains = {c.scenes: c for c in found[0].comparisons if c.key == "HOTA"}
    assert list(gains) == ["one.toml", "two.toml"]
    for gain in gains.values():
        assert gain.verdict == "better"
        assert (gain.after - gain.before) == pytest.approx(gain.difference)
        assert 0 < gain.low <= gain.difference <= gain.high
        assert gain.sequences == 6


def test_the_file_is_read_by_track(found):
    folder = found[1]
    text = (folder / "toy.toml").read_text()
    assert ToyConfig.from_toml(folder / "toy.toml").as_dict() == found[0].config.as_dict()
    assert "HOTA" in text.partition("tracker =")[0]
    assert "training" in text
    assert tomllib.loads(text)["params"]["reach"] == found[0].config.reach
    assert "# default 0.1" in text


@pytest.mark.slow
def test_the_same_again_and_with_two_workers(found, tmp_path):
    """One worker, two workers, a study in memory or on disk: the same bytes."""
    for k, workers in enumerate((1, 2)):
        out = tmp_path / str(k)
        out.mkdir()
        tune(**tune_arguments(tmp_path, workers=workers), out=out / "toy.toml")
        assert contents(out) == contents(found[1])
    tune(**tune_arguments(tmp_path)).write(tmp_path / "toy.toml")
    assert contents(tmp_path) == contents(found[1])


@pytest.mark.slow
@pytest.mark.parametrize("at", [3, 17])
def test_killed_and_gone_on(found, tmp_path, at):
    """SIGKILL in the first trial, in a later one; the journal's last line half-written; the same bytes in the end."""
    assert in_another_process(tmp_path, at).wait(120) == -signal.SIGKILL
    journal = tmp_path / "study.journal"
    with journal.open("ab") as file:
        file.write(b'{"op_code":5,"worker')
    assert not (tmp_path / "toy.toml").exists()
    tune(**tune_arguments(tmp_path), out=tmp_path / "toy.toml", storage=journal, study="toy")
    assert contents(tmp_path) == contents(found[1])
    with open_study(toy_plan(tmp_path), journal, "toy") as study:
        assert [t.number for t in study.finished()] == [t.number for t in study.trials()] == list(range(12))


def test_more_trials_go_on_where_it_ended(found):
    folder = found[1]
    journal = (folder / "toy.journal").read_bytes()
    more = tune(**tune_arguments(folder, trials=14, check=None), storage=folder / "toy.journal", study="toy")
    assert len(more.trials) == 14
    assert more.trials[:12] == found[0].trials
    (folder / "toy.journal").write_bytes(journal)


@pytest.mark.slow
def test_two_processes_begin_a_study_in_one_database(tmp_path):
    """The second one failed with IntegrityError, as both made the tables."""
    url = f"sqlite:///{tmp_path}/study.db"
    others = [in_another_process(tmp_path, -1, f"{k}.toml", url) for k in range(2)]
    assert [other.wait(240) for other in others] == [0, 0]
    assert (tmp_path / "0.json").read_bytes() == (tmp_path / "1.json").read_bytes()
    with open_study(toy_plan(tmp_path), url, "toy") as study:
        assert [t.number for t in study.finished()] == [t.number for t in study.trials()] == list(range(12))


@pytest.mark.slow
def test_two_processes_share_a_journal(tmp_path):
    """The other one does all that this one is not at, and waits for it."""
    made = toy_plan(tmp_path)
    with (
        open_study(made, tmp_path / "study.journal", "toy") as study,
        episode_player(made.tracker, made.detections) as play,
    ):
        mine = study.ask()
        other = in_another_process(tmp_path, -1)
        while len(study.finished()) < made.options.trials - 1:
            assert other.poll() is None
        mine.set_user_attr(LEFT_OUT, [""] * 5)
        study.tell(mine, [0.0])
        run_trials(study, play, lambda done, total, what: None)
        assert other.wait(120) == 0
        numbers = [t.number for t in study.finished()]
    assert numbers == list(range(made.options.trials))
    assert (tmp_path / "toy.toml").is_file()


OTHER_STUDIES = [
    ({"seeds": range(6)}, "seeds"), ({"objective": "MOTA"}, "objective"), ({"set": ["skip=1"]}, "searched"),
    ({"set": ["scenario.duration=5"]}, "motions"), ({"seed": 3}, "seed"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "word"), OTHER_STUDIES)
def test_a_study_about_something_else_is_refused(found, change, word):
    folder = found[1]
    with pytest.raises(InputError, match=f"{word}.* differ"):
        tune(**tune_arguments(folder, **change), storage=folder / "toy.journal", study="toy")


def test_several_goals_give_a_front(tmp_path):
    """Accuracy against the number of people left out, which is 1 - recall: no one is best in both."""
    given = tune_arguments(tmp_path, objective=("DetRe", "DetPr"), trials=8)
    found = tune(**given, out=tmp_path / "toy.toml")
    assert found.front
    assert found.config == found.front[0].config
    assert ToyConfig.from_toml(tmp_path / "toy.front-1.toml").as_dict() == found.config.as_dict()
    for k, one in enumerate(found.front, 1):
        file = tmp_path / f"toy.front-{k}.toml"
        assert ToyConfig.from_toml(file).as_dict() == one.config.as_dict()
        for goal, before, after in zip(found.plan.goals, found.validation[0], one.validation, strict=True):
            assert f"# validation: {goal.key} {before:.4f} → {after:.4f} " in file.read_text()
    first = [c.validation[0] for c in found.front]
    assert first == sorted(first, reverse=True)


def test_a_class_and_its_own_parameters(tmp_path):
    found = tune(**tune_arguments(tmp_path, tracker=Toy, trials=3, check=None, only=["reach"], set=["skip=1"]))
    assert set(found.trials[0].params) == {"reach"}
    assert found.config.skip == found.default.skip == 1
    with pytest.raises(InputError, match="a name that workers can look up"):
        tune(**tune_arguments(tmp_path, tracker=Toy, workers=2))


def test_an_error_of_the_defaults_is_raised(tmp_path):
    broken = tmp_path / "broken.py"
    broken.write_text(
        Path(TOY.rpartition(":")[0]).read_text().replace("pos = detections", "pos = nothing + detections")
    )
    with pytest.raises(FlockscopeError, match="nothing"):
        tune(**tune_arguments(tmp_path, tracker=f"{broken}:Toy"))


@pytest.mark.parametrize("package", ["optuna", "filelock"])
def test_without_a_package_one_line_says_what_to_install(tmp_path, monkeypatch, package):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(InputError, match=rf'no package {package}.*pip install .* -e "\.\[tune\]"'):
        tune(**tune_arguments(tmp_path))


def test_another_version_of_a_tracker_is_another_search(tmp_path):
    code = Path(TOY.rpartition(":")[0]).read_text()
    (tmp_path / "mine.py").write_text(code)
    given = tune_arguments(tmp_path, tracker=f"{tmp_path / 'mine.py'}:Toy", trials=1, check=None)
    tune(**given, out=tmp_path / "toy.toml")
    (tmp_path / "mine.py").write_text(code + "# another\n")
    with pytest.raises(InputError, match="code differ"):
        tune(**given, out=tmp_path / "toy.toml")
