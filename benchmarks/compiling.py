"""What a newcomer waits for: CPU seconds of the first run of each tracker, whose kernels are not compiled yet.

    python -m benchmarks.compiling [--trackers blob,relational] [--detections file] [--kernels 10]

Each tracker runs in a new process with an empty cache of kernels. It simulates the scenario `merge` and tracks it.
First table: CPU seconds of the whole process and of its two steps, imports included, and how many functions were
compiled. Second table: the dearest functions of any tracker, without what they call.
"""

from __future__ import annotations

import multiprocessing
import os
import tempfile
import time
from collections import defaultdict
from concurrent.futures import ProcessPoolExecutor

from benchmarks.support.options import new_parser, one_thread
from benchmarks.support.tables import head, row
from benchmarks.support.timing import machine_load
from sim.types import DetectionMode

TRACKERS = "blob,group-pda,joint,particle,relational,stereo"


def first_run(tracker: str, detections: DetectionMode) -> tuple[float, float, int, dict[str, float]]:
    """Returns CPU seconds of this process at both steps' ends, number of compilations, CPU seconds of each function."""
    from numba.core import event

    import scenarios
    import sim
    import tracking

    alone, running, count = defaultdict[str, float](float), [0.0], 0

    class Clock(event.Listener):
        def on_start(self, event: event.Event) -> None:
            running.append(time.process_time())

        def on_end(self, event: event.Event) -> None:
            nonlocal count
            function, begun = event.data["dispatcher"].py_func, running.pop()
            count += 1
            alone[f"{function.__module__}.{function.__qualname__.partition('.')[0]}"] += time.process_time() - begun
            running[:] = [outer + time.process_time() - begun for outer in running]

    with event.install_listener("numba:compile", Clock()):
        sequence = sim.simulate(scenarios.load("merge"), seed=30001)
        simulated = time.process_time()
        tracking.track(tracker, sequence, detections=detections)
    return simulated, time.process_time(), count, alone


def main() -> None:
    parser = new_parser(__doc__)
    parser.add_argument("--trackers", default=TRACKERS)
    parser.add_argument("--detections", default="file", choices=["file", "image", "truth"])
    parser.add_argument("--kernels", type=int, default=10, help="rows of the second table")
    args = parser.parse_args()
    one_thread()
    print(machine_load())
    dearest: dict[str, float] = {}
    head(["tracker", "CPU s", "simulation", "tracking", "compiled"])
    for tracker in args.trackers.split(","):
        with tempfile.TemporaryDirectory() as cache:
            os.environ["NUMBA_CACHE_DIR"] = cache
            with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as process:
                simulated, whole, count, alone = process.submit(first_run, tracker, args.detections).result()
        dearest.update((name, max(seconds, dearest.get(name, 0.0))) for name, seconds in alone.items())
        row([tracker, f"{whole:.1f}", f"{simulated:.1f}", f"{whole - simulated:.1f}", str(count)])
    head(["function", "CPU s"])
    for name, seconds in sorted(dearest.items(), key=lambda item: -item[1])[: args.kernels]:
        row([name, f"{seconds:.2f}"])


if __name__ == "__main__":
    main()
