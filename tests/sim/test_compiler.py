"""Kernels compile on every machine: in a package that cannot be written, without a home, without any room."""

from __future__ import annotations

import os
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from sim import compiler
from tests.processes import ROOT

KERNEL = """
import warnings
import numpy as np
with warnings.catch_warnings(record=True) as found:
    warnings.simplefilter("always")
    from sim.geometry.hull_kernels import convex_hulls, monotone_chains
(hull,) = convex_hulls([np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.5, 0.5]])])
print(len(hull), monotone_chains._cache.cache_path, *{str(w.message)[:35] for w in found})
"""
NO_OVERRIDE = ["setpriv", "--bounding-set", "-dac_override"] if os.getuid() == 0 else []  # root may write anywhere


@pytest.fixture
def package(tmp_path):
    """A copy of the installation that nobody may write to, and the command of a Python that obeys that."""
    if NO_OVERRIDE and subprocess.run([*NO_OVERRIDE, "true"], capture_output=True, check=False).returncode:
        pytest.skip("no right to give up root's rights")
    folder = tmp_path / "site-packages"
    for name in ("scenarios", "sim", "tracking"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    _allow(folder, False)
    yield folder
    _allow(folder, True)


def _allow(folder: Path, write: bool) -> None:
    for path in [folder, *folder.rglob("*")]:
        mode = stat.S_IMODE(path.stat().st_mode)
        path.chmod(mode | stat.S_IWUSR if write else mode & ~0o222)


def _run(package: Path, words: list[str], **env: str) -> subprocess.CompletedProcess:
    clean = {k: v for k, v in os.environ.items() if not k.startswith(("XDG_", "NUMBA_", "HOME", "TMP", "PYTHON"))}
    environment = {**clean, "PYTHONPATH": str(package), "OMP_NUM_THREADS": "1", **env}
    command = [*NO_OVERRIDE, sys.executable, *words]
    return subprocess.run(command, env=environment, cwd=package, capture_output=True, text=True, check=False)


def test_the_home_takes_the_cache_of_a_read_only_package(package, tmp_path):
    done = _run(package, ["-c", KERNEL], HOME=str(tmp_path / "home"))
    assert done.stdout.startswith(f"4 {tmp_path}/home/.cache/numba/"), done.stderr


@pytest.mark.slow
def test_the_temporary_folder_takes_it_without_a_home(package, tmp_path):
    (tmp_path / "tmp").mkdir()
    env = {"HOME": f"{package}/home", "TMPDIR": str(tmp_path / "tmp")}
    done = _run(package, ["-c", KERNEL], **env)
    own = tmp_path / "tmp" / f"flockscope-kernels-{os.getuid()}"
    assert done.stdout.startswith(f"4 {own}/"), done.stderr
    assert stat.S_IMODE(own.stat().st_mode) == 0o700
    assert list(own.rglob("*.nbi"))


@pytest.mark.slow
def test_there_is_no_cache_without_any_room(package):
    env = {"HOME": f"{package}/home", "TMPDIR": str(package)}
    done = _run(package, ["-c", "import tempfile; tempfile.tempdir = '.'" + KERNEL], **env)
    assert done.stdout == "4 None kernels are compiled anew in every \n", done.stderr


@pytest.mark.parametrize("harm", ["link", "open to all", "file"])
def test_a_temporary_folder_of_others_is_not_used(harm, tmp_path, monkeypatch):
    """Caches hold code that is run, so another user must not have laid them there."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    own = tmp_path / f"flockscope-kernels-{os.getuid()}"
    assert compiler.temporary_cache() == str(own)
    own.rmdir()
    if harm == "link":
        (tmp_path / "other").mkdir()
        own.symlink_to(tmp_path / "other")
    elif harm == "file":
        own.write_text("")
    else:
        own.mkdir()
        own.chmod(0o777)
    assert compiler.temporary_cache() is None


def test_other_faults_of_a_kernel_stay_errors(monkeypatch):
    def refuse(**options):
        raise RuntimeError("another fault")

    monkeypatch.setattr(compiler.numba, "njit", refuse)
    with pytest.raises(RuntimeError, match="another fault"):
        compiler.njit(cache=True)(test_other_faults_of_a_kernel_stay_errors)


USED = """
from sim.compiler import njit
FACTOR = {factor}
@njit(cache=True)
def term(x):
    return x + {term}
"""
USER = """
from sim.compiler import njit
from used import FACTOR, term
@njit(cache=True)
def user(x):
    return later(x)
@njit(cache=True)
def later(x):
    return FACTOR * term(x)
if __name__ == "__main__":
    print(user(1), len(user.stats.cache_hits))
"""


def test_a_kernel_is_compiled_anew_when_what_it_imports_changed(tmp_path):
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}{os.pathsep}{tmp_path}", "NUMBA_CACHE_DIR": str(tmp_path)}

    def printed(factor, term):
        (tmp_path / "used.py").write_text(USED.format(factor=factor, term=term))
        command = [sys.executable, "-B", str(tmp_path / "user.py")]
        return subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout.strip()

    (tmp_path / "user.py").write_text(USER)
    assert [printed(*used) for used in ((10, 1), (10, 1), (20, 1), (20, 2))] == ["20 0", "20 1", "40 0", "60 0"]
