"""Train classifiers on features of pairs; for an environment of its own (pip install scikit-learn numpy).

usage: python classify_pairs.py JOBS.json OUT.npz

Needs nothing of flockscope. Reads sources that `python -m benchmarks.belonging pairs` wrote: FOLDER/NAME.npz with the
arrays features (K, F), mates (K,), part (K,), drawn (K,): rows with False are ignored. JOBS.json: {"folder", "jobs"}.
Held-out predictions are those of FOLDS folds by source and part.

A job {"kind": "mates", "model": "logistic" or "boosted", "train": [names], "test": [names], "columns": [numbers],
"threshold": flag} writes K/NAME for each test source: the probabilities that the pairs are mates. They are held-out
ones if the test source is the training source. With the flag it writes K/threshold, too: the threshold of best F1 of
the held-out predictions.
A job {"kind": "origin", "real": name, "made": name, "mates": flag, "families": [[numbers], …]} tells real pairs of
mates (or of strangers) from made ones; at most ROWS of each are used. It writes K/area, the area under the ROC curve of
held-out predictions (mean over folds), and K/lost, what of it is lost if a family's columns are shuffled together.
"""

import json
import sys

import numpy as np
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.impute import SimpleImputer
from sklearn.linear_model import LogisticRegression
from sklearn.metrics import roc_auc_score
from sklearn.model_selection import GroupKFold
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

FOLDS = 5
ROWS = 30_000


def new_model(kind):
    if kind == "boosted":
        return HistGradientBoostingClassifier(random_state=0)
    return make_pipeline(SimpleImputer(strategy="median"), StandardScaler(), LogisticRegression(max_iter=1000))


def read(folder, names):
    """Returns features, mates and scene (a number) of the drawn rows of some sources."""
    features, mates, scene = [], [], []
    for name in names:
        with np.load(f"{folder}/{name}.npz") as file:
            rows = file["drawn"]
            features.append(file["features"][rows])
            mates.append(file["mates"][rows])
            scene.append(file["part"][rows] + 1_000_000 * len(scene))
    return np.concatenate(features), np.concatenate(mates), np.concatenate(scene)


def folds(x, scene):
    return GroupKFold(FOLDS).split(x, groups=scene)


def held_out(kind, x, y, scene):
    p = np.zeros(len(y))
    for train, test in folds(x, scene):
        p[test] = new_model(kind).fit(x[train], y[train]).predict_proba(x[test])[:, 1]
    return p


def best_threshold(p, y):
    order = np.argsort(-p)
    hits, found = np.cumsum(y[order]), np.arange(1, len(y) + 1)
    f1 = 2 * hits / (found + y.sum())
    f1[:-1][p[order][:-1] == p[order][1:]] = 0  # a threshold cannot part equal probabilities
    return p[order][np.argmax(f1)]


def tell_mates(folder, job):
    x, y, scene = read(folder, job["train"])
    x = x[:, job["columns"]]
    answer = {}
    if job["threshold"] or job["train"] in [[name] for name in job["test"]]:
        p = held_out(job["model"], x, y, scene)
        answer["threshold"] = best_threshold(p, y)
    model = new_model(job["model"]).fit(x, y)
    for name in job["test"]:
        given = read(folder, [name])[0][:, job["columns"]]
        answer[name] = p if job["train"] == [name] else model.predict_proba(given)[:, 1]
    return answer


def tell_origin(folder, job):
    r = np.random.default_rng(0)
    parts = []
    for made, name in enumerate((job["real"], job["made"])):
        x, mates, scene = read(folder, [name])
        rows = np.flatnonzero(mates == job["mates"])
        rows = np.sort(r.permutation(rows)[:ROWS])
        parts.append((x[rows], np.full(len(rows), made), scene[rows] + made * 1_000_000))
    x, y, scene = (np.concatenate(part) for part in zip(*parts, strict=True))
    areas, lost = [], []
    for train, test in folds(x, scene):
        if len(np.unique(y[test])) < 2 or len(np.unique(y[train])) < 2:
            continue
        weight = 1 / np.bincount(y[train])[y[train]]
        model = new_model("boosted").fit(x[train], y[train], sample_weight=weight * len(train) / 2)
        areas.append(roc_auc_score(y[test], model.predict_proba(x[test])[:, 1]))
        lost.append([])
        for family in job["families"]:
            shuffled = x[test].copy()
            shuffled[:, family] = shuffled[r.permutation(len(test))][:, family]
            lost[-1].append(areas[-1] - roc_auc_score(y[test], model.predict_proba(shuffled)[:, 1]))
    return {"area": np.mean(areas), "lost": np.mean(lost, axis=0)}


def main(jobs, out):
    with open(jobs) as file:
        given = json.load(file)
    answers = {}
    for k, job in enumerate(given["jobs"]):
        print(f"\rjob {k + 1} of {len(given['jobs'])}", file=sys.stderr, end="", flush=True)
        answer = {"mates": tell_mates, "origin": tell_origin}[job["kind"]](given["folder"], job)
        answers |= {f"{k}/{name}": value for name, value in answer.items()}
    print(file=sys.stderr)
    np.savez(out, **answers)


if __name__ == "__main__":
    main(*sys.argv[1:])
