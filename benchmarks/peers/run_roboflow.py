"""Run roboflow `trackers` over MOT texts; for an environment of its own (pip install trackers supervision).

usage: python run_roboflow.py TRACKER DET.txt …      TRACKER: sort, bytetrack, ocsort; their defaults throughout

Needs nothing of flockscope. Writes rows `frame,id,left,top,width,height,score,-1,-1,-1` into DET.txt.TRACKER and prints
a JSON list: for each text the CPU seconds inside the tracker's update, its input type ready made; reading, writing and
a first run over WARM frames, in which libraries load, are left out.
"""

import json
import sys
import time
import warnings

import numpy as np

warnings.filterwarnings("ignore")

WARM = 30


def read(path):
    """Detections per frame: a list of (M, 5) left, top, width, height, score for frames 1..last."""
    rows = np.loadtxt(path, delimiter=",", ndmin=2)
    last = int(rows[:, 0].max())
    return [rows[rows[:, 0] == frame][:, 2:7] for frame in range(1, last + 1)]


def main(name, *texts):
    import supervision
    import trackers

    kinds = {"sort": "SORTTracker", "bytetrack": "ByteTrackTracker", "ocsort": "OCSORTTracker"}
    kind = getattr(trackers, kinds[name])
    print(json.dumps([run(kind, supervision.Detections, det, f"{det}.{name}") for det in texts]))


def run(kind, form, det, out):
    given = []
    for box in read(det):
        corners = np.c_[box[:, :2], box[:, :2] + box[:, 2:4]]
        given.append(form(xyxy=corners, confidence=box[:, 4].copy(), class_id=np.zeros(len(box), int)))
    scratch = kind()
    for detections in given[:WARM]:
        scratch.update(detections)
    tracker, answers, start = kind(), [], time.process_time()
    for detections in given:
        answers.append(tracker.update(detections))
    seconds = time.process_time() - start
    with open(out, "w") as file:
        for frame, answer in enumerate(answers, 1):
            for corners, score, id in zip(answer.xyxy, answer.confidence, answer.tracker_id, strict=True):
                if id >= 0:
                    left, top, right, bottom = corners
                    box = ",".join(f"{v:.3f}" for v in (left, top, right - left, bottom - top, score))
                    file.write(f"{frame},{id},{box},-1,-1,-1\n")
    return seconds


if __name__ == "__main__":
    main(*sys.argv[1:])
