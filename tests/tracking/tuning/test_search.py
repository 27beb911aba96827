"""The whole search on a toy: it finds what is known to be wrong, the same every time, whoever is killed at it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from scenarios.errors import FlockscopeError, InputError
from tests.loopback import loopback
from tests.toy_tracker import Toy, ToyConfig
from tests.tuning_toys import TOY, toy_plan, tune_arguments, write_scenes
from tracking.tuning import tune
from tracking.tuning.parallel_episodes import episode_player
from tracking.tuning.sampler import AGAIN
from tracking.tuning.study import FINISHED, open_study, run_trials

ROOT = Path(__file__).resolve().parents[3]
KILLED_AT = """
import os, signal, sys
from pathlib import Path
import tracking.tuning.parallel_episodes as work
from tests.tuning_toys import toy_plan, tune_arguments
from tracking.tuning import tune
played, attempt = 0, work._attempt
def counted(*given):
    global played
    played += 1
    if played == int(sys.argv[2]):
        os.kill(os.getpid(), signal.SIGKILL)
    return attempt(*given)
work._attempt = counted
folder = Path(sys.argv[1])
tune(**tune_arguments(folder), out=folder / sys.argv[3], storage=folder / "study.journal", study="toy")
"""


def in_another_process(folder: Path, at: int, out: str = "toy.toml") -> subprocess.Popen:
    """The search, killed at its episode number `at`."""
    line = [sys.executable, "-c", KILLED_AT, str(folder), str(at), out]
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


def test_the_defaults_come_first(found):
    first = found[0].trials[0]
    assert first.params == {"reach": 0.1, "skip": 0, "colour": "red", "forbidden": 0.0}
    assert first.episodes == 5
    assert not first.pruned


def test_what_changes_nothing_is_left_as_it_was(found):
    """Also where training happened to favour another value: the colour, and what is of pixels only."""
    assert found[0].config.colour == "red"
    assert found[0].config.steps == 1.0
    assert "steps" not in found[0].trials[0].params


def test_the_file_is_read_by_track(found):
    folder = found[1]
    text = (folder / "toy.toml").read_text()
    assert ToyConfig.from_toml(folder / "toy.toml").as_dict() == found[0].config.as_dict()
    assert "HOTA" in text.partition("tracker =")[0]
    assert "training" in text
    assert tomllib.loads(text)["params"]["reach"] == found[0].config.reach
    assert "# default 0.1" in text


def test_files_hold_no_place_and_no_training_score(found):
    result, folder = found
    told = "".join(path.decode() for path in contents(folder).values())
    assert str(folder) not in told
    assert str(ROOT) not in told
    best = max(t.values[0] for t in result.trials if t.values)
    assert f"{best:.4f}" not in (folder / "toy.toml").read_text() or best in [c.after for c in result.comparisons]


def test_all_figures_are_stored(found):
    stored = json.loads((found[1] / "toy.json").read_text())
    played = sum(t.episodes for t in found[0].trials)
    counts = {"trials": 12, "episodes": played, "pruned": found[0].pruned, "impossible": found[0].impossible}
    assert stored["counts"] == counts
    assert stored["comparisons"][0]["low"] == found[0].comparisons[0].low
    assert stored["settings"]["seeds"] == "0:5"
    assert stored["changed"]["reach"] == {"default": 0.1, "tuned": found[0].config.reach}


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
def test_the_same_on_a_cluster(tmp_path):
    """Two workers elsewhere: the same bytes as here."""
    small = {"trials": 4, "check": None, "only": ["reach"]}
    tune(**tune_arguments(tmp_path, **small), out=tmp_path / "toy.toml")
    here = contents(tmp_path)
    for path in tmp_path.glob("toy.*"):
        path.unlink()
    with loopback(tmp_path) as cluster:
        tune(**tune_arguments(tmp_path, cluster=cluster.address, **small), out=tmp_path / "toy.toml")
    assert contents(tmp_path) == here


def test_another_seed_searches_elsewhere(found, tmp_path):
    other = tune(**tune_arguments(tmp_path, seed=1, check=None, trials=4))
    assert [t.params for t in other.trials[1:]] != [t.params for t in found[0].trials[1:4]]


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
        assert len(study.finished()) == 12
        left = [t for t in study.trials() if t.state not in FINISHED]
        assert len(left) == 1
        assert [t.user_attrs[AGAIN] for t in study.trials() if AGAIN in t.user_attrs] == [left[0].number]


def test_more_trials_go_on_where_it_ended(found):
    folder = found[1]
    journal = (folder / "toy.journal").read_bytes()
    more = tune(**tune_arguments(folder, trials=14, check=None), storage=folder / "toy.journal", study="toy")
    assert len(more.trials) == 14
    assert more.trials[:12] == found[0].trials
    (folder / "toy.journal").write_bytes(journal)


@pytest.mark.slow
def test_two_processes_share_a_journal(tmp_path):
    """The other one does all that this one is not at, and waits for it."""
    made = toy_plan(tmp_path)
    with (
        open_study(made, tmp_path / "study.journal", "toy") as study,
        episode_player(made.tracker, made.detections) as play,
    ):
        mine = study.ask()
        assert mine is not None
        other = in_another_process(tmp_path, -1)
        while len(study.finished()) < made.options.trials - 1:
            assert other.poll() is None
        study.tell(mine, [0.0])
        run_trials(study, play, lambda done, total, what: None)
        assert other.wait(120) == 0
        numbers = [t.number for t in study.finished()]
    assert numbers == list(range(made.options.trials))
    assert (tmp_path / "toy.toml").is_file()


@pytest.mark.slow
def test_a_trial_of_another_process_is_not_taken_away(tmp_path):
    """Nor by a third one, which asks while it is played."""
    made = toy_plan(tmp_path, trials=2, only=["reach"])
    with open_study(made, tmp_path / "study.journal", "toy") as study:
        assert study.ask() is not None
        script = KILLED_AT.replace("tune_arguments(folder)", "tune_arguments(folder, trials=2, only=['reach'])")
        line = [sys.executable, "-c", script, str(tmp_path), "3", "toy.toml"]
        assert subprocess.run(line, cwd=ROOT, check=False).returncode == -signal.SIGKILL
        states = [t.state.name for t in study.trials()]
    assert states == ["RUNNING", "RUNNING"]


@pytest.mark.slow
def test_a_study_in_a_database_goes_on_too(tmp_path):
    """Who is at work cannot be known there: what was begun is done again when nothing else is left."""
    made, url = toy_plan(tmp_path, trials=3), f"sqlite:///{tmp_path / 'studies.db'}"
    with open_study(made, url, "toy") as study:
        assert study.ask() is not None
    found = tune(**tune_arguments(tmp_path, trials=3), storage=url, study="toy")
    assert len(found.trials) == 3
    assert any(t.params == made.defaults for t in found.trials)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"seeds": range(6)}, "seeds"),
        ({"objective": "MOTA"}, "objective"),
        ({"set": ["skip=1"]}, "searched"),
        ({"set": ["scenario.duration=5"]}, "motions"),
        ({"seed": 3}, "seed"),
        ({"prune": 0.2}, "prune"),
    ],
)
def test_a_study_about_something_else_is_refused(found, change, word):
    folder = found[1]
    with pytest.raises(InputError, match=f"{word}.* differ") as caught:
        tune(**tune_arguments(folder, **change), storage=folder / "toy.journal", study="toy")
    assert "\n" not in str(caught.value)


def test_another_version_of_a_tracker_is_another_search(tmp_path):
    code = Path(TOY.rpartition(":")[0]).read_text()
    (tmp_path / "mine.py").write_text(code)
    given = tune_arguments(tmp_path, tracker=f"{tmp_path / 'mine.py'}:Toy", trials=1, check=None)
    tune(**given, out=tmp_path / "toy.toml")
    (tmp_path / "mine.py").write_text(code + "# another\n")
    with pytest.raises(InputError, match="code differ"):
        tune(**given, out=tmp_path / "toy.toml")


def test_several_goals_give_a_front(tmp_path):
    """Accuracy against the number of people left out, which is 1 - recall: no one is best in both."""
    given = tune_arguments(tmp_path, objective=("DetRe", "DetPr"), trials=8)
    found = tune(**given, out=tmp_path / "toy.toml")
    assert found.front
    assert found.pruned == 0
    assert (tmp_path / "toy.front.svg").is_file()
    assert found.config == found.front[0].config
    assert ToyConfig.from_toml(tmp_path / "toy.front-1.toml").as_dict() == found.config.as_dict()
    for k, one in enumerate(found.front, 1):
        file = tmp_path / f"toy.front-{k}.toml"
        assert ToyConfig.from_toml(file).as_dict() == one.config.as_dict()
        for goal, before, after in zip(found.plan.goals, found.validation[0], one.validation, strict=True):
            assert f"# validation: {goal.key} {before:.4f} → {after:.4f} " in file.read_text()
    first = [c.validation[0] for c in found.front]
    assert first == sorted(first, reverse=True)


def test_speed_is_a_goal(tmp_path):
    found = tune(**tune_arguments(tmp_path, objective=("HOTA", "frames/s"), trials=3, check=None))
    assert all(t.values[1] > 1 for t in found.trials if not t.error)
    assert {c.key for c in found.comparisons} >= {"HOTA", "frames/s"} or not found.changed


def test_a_class_and_its_own_parameters(tmp_path):
    found = tune(**tune_arguments(tmp_path, tracker=Toy, trials=3, check=None, only=["reach"], set=["skip=1"]))
    assert set(found.trials[0].params) == {"reach"}
    assert found.config.skip == found.default.skip == 1
    with pytest.raises(InputError, match="a name that workers can look up"):
        tune(**tune_arguments(tmp_path, tracker=Toy, workers=2))


def test_where_nothing_is_better_the_defaults_stay(tmp_path):
    found = tune(**tune_arguments(tmp_path, only=["colour"], trials=3))
    assert found.config == found.default
    assert found.comparisons == ()
    assert "the defaults stay" in str(found)


def test_long_settings_are_told_short_and_stored_whole(tmp_path):
    long = "sensor.by_visibility=[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]"
    many = [
        "sensor.detect_prob=0.9",
        "sensor.noise_m=0.1",
        "sensor.box_noise.scale=2.0",
        "sensor.persistence=0.1",
        long,
    ]
    profile = str(tune(**tune_arguments(tmp_path, trials=1, set=["scenario.duration=2", *many])))
    assert "\nscenes with a detector of 5 settings, duration=2\n" in profile
    given = tune_arguments(tmp_path, trials=1, set=[long, "scenario.duration=2"], out=tmp_path / "found.toml")
    (told,) = (line for line in str(tune(**given)).splitlines() if line.startswith("scenes with"))
    assert "duration=2" in told
    assert "sensor.by_visibility=[" in told
    assert "0.6]" not in told
    assert "0.6]" in (tmp_path / "found.json").read_text()


def test_an_error_of_the_defaults_is_raised(tmp_path):
    broken = tmp_path / "broken.py"
    broken.write_text(
        Path(TOY.rpartition(":")[0]).read_text().replace("pos = detections", "pos = nothing + detections")
    )
    with pytest.raises(FlockscopeError, match="nothing"):
        tune(**tune_arguments(tmp_path, tracker=f"{broken}:Toy"))


def test_without_optuna_one_line_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "optuna", None)
    with pytest.raises(InputError, match=r'pip install "flockscope\[tune\]"') as caught:
        tune(**tune_arguments(tmp_path))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["toy.json", "toy"])
def test_out_is_a_toml_file(tmp_path, name):
    with pytest.raises(InputError, match=r"\.toml"):
        tune(**tune_arguments(tmp_path), out=tmp_path / name)
    write_scenes(tmp_path)


def test_a_storage_that_is_none(tmp_path):
    for url in ("nonsense://x", f"sqlite:////proc/{tmp_path.name}/x.db"):
        with pytest.raises(InputError, match="--storage") as caught:
            tune(**tune_arguments(tmp_path), storage=url)
        assert "\n" not in str(caught.value)


def test_the_similarity_of_people_is_an_option(tmp_path: Path) -> None:
    """It decides the scores, stands in the written file, and belongs to a study."""
    found = {}
    for similarity in (None, "boxes"):
        made = tmp_path / f"{similarity}.toml"
        result = tune(**{**tune_arguments(tmp_path), "trials": 1, "tracker": "blob"}, similarity=similarity, out=made)
        found[similarity] = result.validation[0]
        settings = json.loads(made.with_suffix(".json").read_text())["settings"]
        assert settings["similarity"] == (similarity or "by the data")
        assert ("compared by boxes" in made.read_text()) == (similarity == "boxes")
    assert found[None] != found["boxes"]
    again = {**tune_arguments(tmp_path), "trials": 2, "tracker": "blob"}
    with pytest.raises(InputError, match="similarity"):
        tune(**again, similarity="ground", out=tmp_path / "boxes.toml")
    with pytest.raises(InputError, match="--similarity"):
        tune(**tune_arguments(tmp_path), similarity="volume")
    with pytest.raises(InputError, match="identity is known"):
        tune("grouping", "cross", 1, similarity="image")
