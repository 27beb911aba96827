"""`flockscope compare`: verdicts from intervals and tolerance, exit codes, and what is no comparison."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.gate import false_regressions
from tests.processes import FAKE
from tests.refusals import refused
from tracking.app.cli import run
from tracking.app.commands.compare import judged
from tracking.scoring.conditions import CONDITIONS

KEYS = ("objective", "IDSW")
WAY = dict.fromkeys(CONDITIONS, "a") | {"label_step": 1, "px_per_m": None}


def stored(path: Path, objective, switches=None, **more) -> str:
    columns = [np.asarray(objective, float), np.zeros(len(objective)) if switches is None else switches]
    rows = [
        {"name": f"s{k}", **WAY, **dict(zip(KEYS, map(float, values), strict=True)), **more}
        for k, values in enumerate(zip(*columns, strict=True))
    ]
    path.write_text(json.dumps({"status": "ok", "sequences": rows}))
    return str(path)


BASE = np.array([0.5, 0.6, 0.7, 0.8, 0.55, 0.65])
NOISE = np.array([0.02, -0.02, 0.01, -0.01, 0.015, -0.015])


VERDICTS = [
    (-0.1 + NOISE, "regression", 1),
    (0.1 + NOISE, "improvement", 0),
    (NOISE / 10, "no difference", 0),
    (10 * NOISE, "too noisy", 2),
    (-0.05 + 10 * NOISE, "too noisy", 2),
    (0.05 + 10 * NOISE, "too noisy", 2),
    (-0.005 + NOISE / 100, "no difference", 0),
]


@pytest.mark.parametrize(("change", "verdict", "code"), VERDICTS)
def test_verdicts(change, verdict, code, tmp_path, capsys):
    before, now = stored(tmp_path / "a.json", BASE), stored(tmp_path / "b.json", BASE + change)
    assert run(["compare", before, now, "--json"]) == code
    (row,) = json.loads(capsys.readouterr().out)["scores"]
    assert row["verdict"] == verdict
    assert row["low"] <= row["difference"] <= row["high"]


def test_more_switches_are_worse(tmp_path, capsys):
    before = stored(tmp_path / "a.json", BASE, np.arange(6.0))
    now = stored(tmp_path / "b.json", BASE, np.arange(6.0) + 3 + NOISE)
    assert run(["compare", before, now, "--by", "IDSW", "--by", "objective"]) == 1
    assert "IDSW" in (text := capsys.readouterr().out)
    assert "regression" in text


def test_a_saved_baseline_gives_the_same_verdict(tmp_path, capsys):
    before, now = stored(tmp_path / "a.json", BASE), stored(tmp_path / "b.json", BASE - 0.1 + NOISE)
    small = tmp_path / "small.json"
    assert run(["compare", before, before, "--save", str(small)]) == 0
    capsys.readouterr()
    assert run(["compare", str(small), now]) == 1
    rows = json.loads(small.read_text())["sequences"]
    assert rows == [{"name": f"s{k}", **WAY, "objective": value} for k, value in enumerate(BASE.tolist())]


def verdicts(capsys, *words: object) -> tuple[int, dict]:
    capsys.readouterr()
    code = run(["compare", *map(str, words), "--json"])
    return code, json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_fewer_sequences_than_a_ranking_needs_decide_nothing(count, tmp_path, capsys):
    """Equal differences have an interval without width. Six sequences, as the remedy says, are enough."""
    before, now = stored(tmp_path / "a.json", BASE[:count]), stored(tmp_path / "b.json", BASE[:count] - 0.1)
    code, found = verdicts(capsys, before, now)
    assert (code, found["status"], found["scores"][0]["verdict"]) == (2, "refused", "too few")
    assert found["error"]["remedy"] == "generate more seeds"
    before, now = stored(tmp_path / "a.json", BASE), stored(tmp_path / "b.json", BASE - 0.1)
    assert verdicts(capsys, before, now)[0] == 1


def test_a_larger_tolerance_decides_what_is_too_noisy(tmp_path, capsys):
    before, now = stored(tmp_path / "a.json", BASE), stored(tmp_path / "b.json", BASE + 10 * NOISE)
    code, found = verdicts(capsys, before, now)
    assert (code, found["error"]["place"]) == (2, "objective")
    assert "a larger --tolerance" in found["error"]["remedy"]
    assert verdicts(capsys, before, now, "--tolerance", "0.2")[0] == 0


def changed(path: str, k: int, **values) -> str:
    document = json.loads(Path(path).read_text())
    row = document["sequences"][k] | values
    document["sequences"][k] = {key: value for key, value in row.items() if value != "absent"}
    Path(path).write_text(json.dumps(document))
    return path


@pytest.mark.parametrize("unknown", [None, "absent"])
def test_what_was_known_and_is_unknown_is_a_regression(unknown, tmp_path, capsys):
    """All that is still known has improved."""
    before, now = stored(tmp_path / "a.json", BASE), stored(tmp_path / "b.json", BASE + 0.1)
    code, found = verdicts(capsys, before, changed(now, 3, objective=unknown))
    (row,) = found["scores"]
    assert (code, row["verdict"], row["sequences"], row["unknown_now"]) == (1, "regression", 5, ["s3"])
    assert run(["compare", before, now]) == 1
    assert "objective: known before, unknown now: s3" in capsys.readouterr().out


def test_a_missing_sequence_is_a_regression(tmp_path, capsys):
    code, found = verdicts(capsys, stored(tmp_path / "a.json", BASE), stored(tmp_path / "b.json", BASE[:5] + 0.1))
    assert (code, found["scores"][0]["unknown_now"]) == (1, ["s5"])


def test_what_is_known_only_now_is_listed_and_improves_nothing(tmp_path, capsys):
    before, now = stored(tmp_path / "a.json", np.append(BASE, 0.1)), stored(tmp_path / "b.json", np.append(BASE, 0.9))
    code, found = verdicts(capsys, changed(before, 6, objective=None), now)
    (row,) = found["scores"]
    assert (code, row["verdict"], row["sequences"], row["known_now"]) == (0, "no difference", 6, ["s6"])


def events(path: Path, f1: list[float | None], recall: float | None) -> str:
    rows = [{"name": f"s{k}", **WAY, "merge_F1": f, "merge_recall": recall} for k, f in enumerate(f1)]
    path.write_text(json.dumps({"sequences": rows}))
    return str(path)


def test_a_false_alarm_that_is_gone_is_no_regression(tmp_path, capsys):
    """Without true merges a false one gives F1 = 0, and none gives no F1. With true ones, unknown is a regression."""
    some, none = [0.5] * 6 + [0.0], [0.5] * 6 + [None]
    now = events(tmp_path / "b.json", none, None)
    before = events(tmp_path / "a.json", some, None)
    code, found = verdicts(capsys, before, now, "--by", "merge_F1", "--save", tmp_path / "c.json")
    assert (code, found["scores"][0]["sequences"]) == (0, 6)
    assert "merge_recall" in json.loads((tmp_path / "c.json").read_text())["sequences"][0]
    before = events(tmp_path / "a.json", some, 0.5)
    assert verdicts(capsys, before, now, "--by", "merge_F1")[0] == 1


RANK = {"regression": 0, "too few": 1, "too noisy": 1, "no difference": 2, "improvement": 3}
SCORES = st.lists(st.integers(0, 100).map(lambda n: n / 100), min_size=24, max_size=24)


@given(SCORES, st.lists(st.integers(0, 11), min_size=1, max_size=12), st.sampled_from([0.0, 0.01]))
def test_a_score_that_becomes_unknown_never_improves_a_verdict(values, lost, tolerance):
    before, now = np.reshape(values, (2, 12, 1))
    names = [f"s{k}" for k in range(12)]
    (whole,) = judged(["HOTA"], names, before, now, tolerance)
    now = now.copy()
    now[lost] = np.nan
    (row,) = judged(["HOTA"], names, before, now, tolerance)
    assert RANK[row["verdict"]] <= RANK[whole["verdict"]]
    assert row["verdict"] == "regression"
    assert row["unknown_now"] == [names[k] for k in sorted(set(lost))]


@given(SCORES, st.lists(st.integers(0, 11), min_size=1, max_size=12), st.sampled_from([0.0, 0.01]))
def test_a_score_that_becomes_known_has_no_effect(values, found, tolerance):
    before, now = np.reshape(values, (2, 12, 1))
    before = before.copy()
    before[found] = np.nan
    kept = np.isfinite(before[:, 0])
    names = np.array([f"s{k}" for k in range(12)])
    (whole,) = judged(["HOTA"], names.tolist(), before, now, tolerance)
    (row,) = judged(["HOTA"], names[kept].tolist(), before[kept], now[kept], tolerance)
    assert whole["known_now"] == names[~kept].tolist()
    assert (whole["verdict"], whole["sequences"]) == (row["verdict"], row["sequences"])


def test_rounding_of_another_processor_is_no_difference(tmp_path, capsys):
    before, now = stored(tmp_path / "a.json", BASE), stored(tmp_path / "b.json", np.nextafter(BASE, 0))
    code, found = verdicts(capsys, before, now, "--tolerance", "0")
    assert (code, found["scores"][0]["verdict"]) == (0, "no difference")


def twice(path: str) -> str:
    """A file with a score twice, as a merge of two versions can leave it."""
    text = Path(path).read_text()
    Path(path).write_text(text.replace('"objective"', '"HOTA": 0.9, "HOTA": 0.5, "objective"', 1))
    return path


NOT_COMPARED = [
    (lambda p: stored(p, np.append(BASE, 0.5)), "other sequences: got s6, not in"),
    (lambda p: str(p.parent), "no scores of sequences; expected a file of `flockscope score --json`"),
    (lambda p: (p.write_text('{"sequences": [{"name": "a"}, {"name": "a"}]}'), str(p))[1], "a sequence twice"),
    (lambda p: (p.write_text('{"sequences": [{"name": 3}]}'), str(p))[1], "no scores of sequences"),
    (
        lambda p: changed(stored(p, BASE), 1, objective=1e308),
        "s1: objective: got 1e+308; expected a number from 0 to 1",
    ),
    (lambda p: changed(stored(p, BASE), 1, objective="0.5"), "s1: objective: got '0.5'"),
    (lambda p: changed(stored(p, BASE), 1, objective=True), "s1: objective: got True"),
    (lambda p: changed(stored(p, BASE), 1, objective=[0.5]), "s1: objective: got [0.5]"),
    (lambda p: changed(stored(p, BASE), 1, objective=float("nan")), "NaN, which is no number of JSON"),
    (lambda p: changed(stored(p, BASE), 1, objective=-float("inf")), "-Infinity, which is no number of JSON"),
    (lambda p: twice(stored(p, BASE)), "the key 'HOTA' twice in an object"),
]


@pytest.mark.parametrize(("write", "words"), NOT_COMPARED)
def test_what_is_not_compared_ends_with_2(write, words, tmp_path, capsys):
    before = stored(tmp_path / "a.json", BASE)
    assert words in refused(capsys, "compare", before, write(tmp_path / "b.json"))


@pytest.mark.parametrize("switches", [1e308, 1e19])
def test_a_score_without_bound_is_refused_before_sums_overflow(switches, tmp_path, capsys):
    file = stored(tmp_path / "a.json", BASE, np.full(6, switches))
    assert "s0: IDSW: got 1e+" in refused(capsys, "compare", file, file, "--by", "IDSW")


@pytest.mark.parametrize("key", CONDITIONS)
def test_scores_made_in_another_way_are_not_compared(key, tmp_path, capsys):
    """In another way, or stated on one side alone; on neither side, the command says so."""
    before, now = stored(tmp_path / "a.json", BASE), stored(tmp_path / "b.json", BASE)
    assert f"s2: {key}: got 'b'" in refused(capsys, "compare", before, changed(now, 2, **{key: "b"}))
    assert f"s2: {key}: got nothing" in refused(capsys, "compare", before, changed(now, 2, **{key: "absent"}))
    assert "expected nothing" in refused(capsys, "compare", now, before)
    code, found = verdicts(capsys, now, now)
    assert (code, found["notes"]) == (0, [f"not compared, as neither side states it: {key}"])


OPTIONS = [
    (["--by", "HOTA"], "HOTA: got no value; expected a known score"),
    (["--by", "objective", "--by", "IDSW", "--by", "objective"], "--by: got objective twice"),
    (["--save", "mine.txt"], "ends in .json"),
    (["--tolerance", "1"], "--tolerance: got 1"),
    (["--tolerance", "nan"], "--tolerance"),
    (["--tolerance", "inf", "--by", "IDSW"], "--tolerance"),
]


@pytest.mark.parametrize(("more", "words"), OPTIONS)
def test_scores_and_files_that_cannot_be(more, words, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = stored(tmp_path / "a.json", BASE)
    assert words in refused(capsys, "compare", file, file, *more)
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]


def test_the_remedy_for_an_unknown_score_works(tmp_path, capsys):
    file = stored(tmp_path / "a.json", BASE)
    line = refused(capsys, "compare", file, file, "--by", "HOTA")
    assert line.endswith("--by objective --by IDSW")
    assert verdicts(capsys, file, file, *line.split(": ")[-1].split())[0] == 0


def test_several_scores_are_corrected_together(tmp_path, capsys):
    """t = -3 on 5 degrees of freedom: p = 0.0301, below 0.05; beside three other scores it must be below 0.0125."""
    change = np.array([-1.0, -1, -1, 1, 1, 1]) * 0.01
    change = (change - change.mean()) / change.std(ddof=1) * 0.05
    change -= 3 * 0.05 / np.sqrt(6)
    before, after = (np.column_stack([BASE] * 4) for _ in "ab")
    after[:, 0] += change
    names = [f"s{k}" for k in range(6)]
    assert judged(["HOTA"], names, before[:, :1], after[:, :1], 0.0)[0]["verdict"] == "regression"
    assert judged(["HOTA", "MOTA", "IDF1", "DetA"], names, before, after, 0.0)[0]["verdict"] == "too noisy"


@pytest.mark.parametrize("sequences", [2, 3, 6, *(pytest.param(n, marks=pytest.mark.slow) for n in (12, 24))])
@pytest.mark.parametrize("scores", [1, 4])
def test_calls_without_a_difference_are_rarely_regressions(sequences, scores):
    """At most 5 % of 1000 calls, plus two standard deviations of the count, for each law."""
    for law, count in false_regressions(sequences, scores, 1000).items():
        assert count <= (50 + 14 if sequences >= 6 else 0), law


OTHER_WAYS = [
    ("--similarity image", "similarity"), ("--group-match members", "group_match"), ("--px-per-m 40", "px_per_m"),
    ("--class 1,8", "unscored"), ("--fps 10", "truth"),
]  # fmt: skip


@pytest.mark.parametrize(("options", "key"), OTHER_WAYS)
def test_another_way_of_scoring_is_in_the_file(options, key, tmp_path, capsys):
    """Two people, and a distractor of MOT17 (class 8), whom `--class 1,8` makes a person."""
    people = [(f, i) for f in range(1, 31) for i in (1, 2, 3)]
    rows = [(f, i, 100 + 10 * f + 200 * i, 100, 40, 120, 1, 8 if i == 3 else 1, 1) for f, i in people]
    (tmp_path / "gt.txt").write_text("".join(",".join(map(str, row)) + "\n" for row in rows))
    tracks = [(*row[:2], row[2] + 4, *row[3:6], 1, -1, -1, -1) for row in rows]
    (tmp_path / "tracks.txt").write_text("".join(",".join(map(str, row)) + "\n" for row in tracks))
    files = []
    for name, more in (("a", []), ("b", options.split())):
        assert run(["score", str(tmp_path / "gt.txt"), str(tmp_path / "tracks.txt"), "--json", *more]) == 0
        files.append(tmp_path / f"{name}.json")
        files[-1].write_text(capsys.readouterr().out)
    assert json.loads(files[0].read_text())["sequences"][0].keys() >= set(CONDITIONS)
    line = refused(capsys, "compare", *files)
    assert f": {key}: got" in line
    assert "in the same way" in line


@pytest.mark.parametrize("tracker", [FAKE, "blob"])
def test_runs_from_other_detections_are_not_compared(tracker, tmp_path, capsys):
    """The same labels and mode; in the second folder the detector found everybody, in the third as in the first."""
    rows = [(f, i, 100 + 10 * f + 200 * i, 100, 40, 120) for f in range(1, 31) for i in (1, 2)]
    found = [row for row in rows if row[0] % 3]
    files, truth = [], tmp_path / "a" / "sequence"
    for name, detected in (("a", found), ("b", rows), ("c", found)):
        folder = tmp_path / name / "sequence"
        for text, lines in (("gt", rows), ("det", [(f, -1, *box) for f, _, *box in detected])):
            (folder / text).mkdir(parents=True)
            table = "".join(",".join(map(str, (*row, 1, -1, -1, -1))) + "\n" for row in lines)
            (folder / text / f"{text}.txt").write_text(table)
        assert run(["track", tracker, str(folder), "--out", str(tmp_path / f"run-{name}")]) == 0
        capsys.readouterr()
        assert run(["score", str(truth), str(tmp_path / f"run-{name}"), "--json"]) == 0
        files.append(tmp_path / f"{name}.json")
        files[-1].write_text(capsys.readouterr().out)
    assert "sequence: detections: got '" in refused(capsys, "compare", *files[:2])
    assert verdicts(capsys, files[0], files[2])[1]["scores"][0]["verdict"] == "too few"
    assert run(["score", str(truth), str(tmp_path / "run-a"), str(tmp_path / "run-b")]) == 0
    assert "the runs got different stored detections: the oracle got those of TRUTH" in capsys.readouterr().out
