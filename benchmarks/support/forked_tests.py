"""Runs tests of a tree in a process that is forked with the libraries loaded and ends by itself after some CPU time."""

from __future__ import annotations

import gc
import json
import os
import resource
import signal
import sys
import tempfile
from collections.abc import Collection, Sequence
from multiprocessing import get_context
from pathlib import Path
from types import ModuleType

import pytest

LIBRARIES = (
    "numpy", "scipy.optimize", "scipy.spatial", "scipy.stats", "numba", "cv2", "pydantic", "pymunk", "pyarrow", "rich",
    "typer", "hypothesis", "hypothesis.strategies", "pytest", __name__,
)  # fmt: skip
OWN = ("__main__", "benchmarks", "scenarios", "sim", "tests", "tracking")  # to be loaded from the tree
ONE_TEST = 30.0  # s of CPU time after which SIGPROF ends a test as one without end; compiling included
WALL = 900.0  # s after which SIGKILL ends tests that wait for ever
MEMORY = 6 * 2**30  # bytes


class FirstFailure:
    """A plugin of pytest: the first test that fails; no test starts after `seconds` of CPU time."""

    def __init__(self, seconds: float) -> None:
        self.seconds, self.failed, self.why = seconds, "", ""

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self) -> bool | None:
        """Returns True, which leaves the test out, if the time is over."""
        if spent() > self.seconds:
            return True
        signal.setitimer(signal.ITIMER_PROF, ONE_TEST)
        return None

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Notes a test that failed."""
        self._note(report)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Notes a file that cannot be imported."""
        self._note(report)

    def _note(self, report: pytest.TestReport | pytest.CollectReport) -> None:
        if report.failed and not self.failed:
            self.failed, self.why = report.nodeid, report.longreprtext


def spent() -> float:
    """Returns the CPU time, s, of this process and of its children that have ended."""
    return sum(os.times()[:4])


def first_failure(
    tree: Path, tests: Sequence[str], left_out: Collection[str], seconds: float
) -> tuple[str, str, float]:
    """Returns the first of the fast tests that fails, the end of its report, and the CPU time, s.

    The name is "" if none fails, and that of the signal if one ended the process.

    tree: the folder whose tests and modules are loaded. tests: files or tests in it; left_out: not these.
    """
    tests = [test for test in tests if test not in left_out and (tree / test.partition("::")[0]).is_file()]
    if not tests:
        return "", "", 0.0
    context = get_context("forkserver")
    context.set_forkserver_preload(list(LIBRARIES))
    with tempfile.NamedTemporaryFile("r+") as result:
        words = [*(f"--deselect={test}" for test in left_out), *tests]
        process = context.Process(target=_run, args=(tree, words, seconds, result.name))
        process.start()
        process.join(WALL)
        if process.is_alive():
            assert process.pid is not None
            os.killpg(process.pid, signal.SIGKILL)
            process.join()
        text = result.read()
    if not text and (process.exitcode or 0) >= 0:
        raise RuntimeError(f"tests ended with exit code {process.exitcode}: {words}")
    failed, why, used = json.loads(text) if text else (f"signal {-(process.exitcode or 0)}", "", 0.0)
    return failed, why, used


def _run(tree: Path, words: list[str], seconds: float, result: str) -> None:
    os.setsid()
    os.chdir(tree)
    os.environ.update(PYTHONPATH=str(tree), PYTHONDONTWRITEBYTECODE="1")
    sys.dont_write_bytecode = True
    sys.path.insert(0, str(tree))
    for name in [name for name in sys.modules if name.partition(".")[0] in OWN]:
        del sys.modules[name]
    sys.modules["__main__"] = ModuleType("__main__")
    gc.collect()
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.dup2(1, 2)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    watch = FirstFailure(seconds)
    code = pytest.main(
        ["-q", "-x", "-m", "not slow", "-n", "0", "--tb", "no", "--assert", "plain", *words], plugins=[watch]
    )
    if code not in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
        watch.failed = watch.failed or f"exit code {int(code)}"
    Path(result).write_text(json.dumps([watch.failed, watch.why[-2000:], spent()]), encoding="utf-8")
    os._exit(0)
