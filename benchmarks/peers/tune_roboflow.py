"""CPU seconds of a trial of roboflow's own tuner.

usage: python tune_roboflow.py FOLDER TRACKER TRIALS      FOLDER: gt/*.txt and det/*.txt, MOT text; TRACKER: sort, …

Runs in an environment of its own (pip install trackers supervision optuna) and needs nothing of flockscope. The
objective is HOTA; the defaults are the first trial. Prints one JSON object: "seconds", the least CPU seconds of a trial
after the first, in which libraries load; "best", the best HOTA by the tuner's own measure.
"""

import json
import sys
import time
import warnings
from pathlib import Path

warnings.filterwarnings("ignore")


def main(folder, name, trials):
    import optuna
    from trackers.tune import Tuner

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    given = {"objective": "HOTA", "metrics": ["HOTA"], "n_trials": 1, "seed": 0}
    tuner = Tuner(name, Path(folder) / "gt", Path(folder) / "det", **given)
    tuner.run()
    spent, best = [], 0.0
    for seed in range(trials):
        tuner._seed = seed  # different parameters in each trial
        tuner._default_trial_params = None
        begun = time.process_time()
        tuner.run()
        spent.append(time.process_time() - begun)
        best = max(best, tuner.study.best_value)
    print(json.dumps({"seconds": min(spent), "best": best}))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
