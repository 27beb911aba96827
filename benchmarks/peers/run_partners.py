"""F1 of a boosted classifier that learns who are partners; for an environment of its own with scikit-learn.

usage: python run_partners.py ROWS.npz ASKED F1.npy
ROWS: of each of K samples, "pairs k" (P, F), "partners k" (P,), "moments k" (R, M), "mates k" (R,), k from 0. Writes
(K, ASKED, 4): of what is learned from each sample on each of the first ASKED: pairs, the same with classes of equal
weight, moments, the same with classes of equal weight.
"""

import sys

import numpy as np
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.metrics import f1_score

COLUMNS = [(*kind, weight) for kind in (("pairs", "partners"), ("moments", "mates")) for weight in (None, "balanced")]


def main():
    asked = int(sys.argv[2])
    with np.load(sys.argv[1]) as given:
        rows = dict(given)
    found = np.empty((len(rows) // 4, asked, len(COLUMNS)))
    for k in range(len(found)):
        for c, (values, label, weight) in enumerate(COLUMNS):
            learner = HistGradientBoostingClassifier(class_weight=weight, random_state=0)
            learner.fit(rows[f"{values} {k}"], rows[f"{label} {k}"])
            for a in range(asked):
                found[k, a, c] = f1_score(rows[f"{label} {a}"], learner.predict(rows[f"{values} {a}"]))
    np.save(sys.argv[3], found)


if __name__ == "__main__":
    main()
