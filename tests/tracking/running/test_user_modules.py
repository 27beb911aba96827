"""Modules beside a tracker's file: names that others have, too, folders with equal names, files that change."""

from __future__ import annotations

import pickle
import queue
import re
import subprocess
import sys
import types
from pathlib import Path

import pytest

import sim
import tracking
from scenarios.errors import InputError
from tracking.running.tracker_registry import find

TRACKER = """
from sim.types import Tracks
from tracking.config import Config
{imports}
class Mine:
    needs = ("points",)
    value = {value}
    def reset(self, context, seed): ...
    def step(self, frame, detections):
        import later
        return later.answer
"""


def write(folder: Path, imports: str, value: str, **modules: str) -> str:
    folder.mkdir(exist_ok=True)
    for name, text in {"later": "answer = 1", **modules}.items():
        (folder / f"{name}.py").write_text(text)
    (folder / "mine.py").write_text(TRACKER.format(imports=imports, value=value))
    return f"{folder}/mine.py:Mine"


OWN = "def mine(): return 7"


@pytest.mark.parametrize("name", ["tracking", "sim", "scenarios", "types", "queue", "numpy", "time", "json"])
@pytest.mark.parametrize(
    ("imports", "value"),
    [("import {0}", "{0}.mine()"), ("from {0} import mine", "mine()"), ("import {0} as m", "m.mine()")],
)
def test_a_neighbour_with_the_name_of_another_module_is_found_and_hides_nothing(
    tmp_path: Path, name: str, imports: str, value: str
) -> None:
    before = dict(sys.modules)
    spec = write(tmp_path, imports.format(name), value.format(name), **{name: OWN})
    assert find(spec).value == 7
    assert sys.modules[name] is before.get(name, sys.modules[name])
    assert not hasattr(sys.modules[name], "mine")
    assert (tracking.track.__module__, sim.simulate.__module__) == ("tracking.running.run", "sim.sequence")
    assert (types.SimpleNamespace.__module__, queue.Queue.__module__) == ("types", "queue")


@pytest.mark.parametrize(
    ("imports", "value"),
    [
        ("import tracking", "(tracking.mine(), tracking.evaluate.__name__)"),
        ("from tracking import mine, evaluate", "(mine(), evaluate.__name__)"),
        (
            "import tracking.config\nfrom tracking import mine",
            "(mine(), 'evaluate' * (tracking.config.Config is Config))",
        ),
    ],
)
def test_what_a_neighbour_lacks_is_taken_from_the_other_module(tmp_path: Path, imports: str, value: str) -> None:
    assert find(write(tmp_path, imports, value, tracking=OWN)).value == (7, "evaluate")


def test_a_name_that_both_lack_is_an_error_that_names_both_files(tmp_path: Path) -> None:
    spec = write(tmp_path, "from tracking import nothing", "0", tracking=OWN)
    with pytest.raises(InputError, match=rf"{tmp_path}/tracking.py nor .*init__.py has 'nothing'"):
        find(spec)


WRONG = {"from helper import no": "from 'helper' (", "import helper.no": "'helper.no'"}


@pytest.mark.parametrize(("imports", "words"), WRONG.items())
def test_errors_have_the_names_that_the_user_gave(tmp_path: Path, imports: str, words: str) -> None:
    with pytest.raises(InputError, match=re.escape(words)):
        find(write(tmp_path, imports, "0", helper=""))


def test_a_file_may_have_the_name_of_one_of_our_packages(tmp_path: Path) -> None:
    write(tmp_path, "", "5")
    (tmp_path / "mine.py").rename(tmp_path / "sim.py")
    assert find(f"{tmp_path}/sim.py:Mine").value == 5


def test_folders_with_modules_of_equal_names_do_not_mix(tmp_path: Path) -> None:
    specs = [write(tmp_path / n, "from helper import x", "x", helper=f"x = {n}", later=f"answer = {n}") for n in "12"]
    assert [find(spec).value for spec in (*specs, *specs)] == [1, 2, 1, 2]
    assert [find(spec)().step(None, None) for spec in (*specs, *specs)] == [1, 2, 1, 2]


@pytest.mark.parametrize("edited", ["mine", "helper", "deep", "later"])
def test_a_changed_module_is_loaded_anew(tmp_path: Path, edited: str) -> None:
    """Of the same size and in the same moment, so that neither tells."""
    spec = write(tmp_path, "from helper import x", "x + 0", helper="from deep import x", deep="x = 1")
    first = find(spec)
    assert (first.value, first().step(None, None)) == (1, 1)
    assert find(spec) is first
    changed = {
        "mine": ("x + 0", "x + 1"),
        "helper": ("import x", "import y as x"),
        "deep": ("= 1", "= 2"),
        "later": ("1", "2"),
    }
    (tmp_path / "deep.py").write_text("x, y = 1, 2") if edited == "helper" else None
    path = tmp_path / f"{edited}.py"
    path.write_text(path.read_text().replace(*changed[edited]))
    again = find(spec)
    assert (again.value, again().step(None, None)) == ((1, 2) if edited == "later" else (2, 1))


def test_packages_and_relative_imports_beside_the_file(tmp_path: Path) -> None:
    for name, text in {"__init__": "", "filters": "from .gain import k", "gain": "k = 3"}.items():
        (tmp_path / "parts").mkdir(exist_ok=True)
        (tmp_path / "parts" / f"{name}.py").write_text(text)
    (tmp_path / "plain").mkdir()
    (tmp_path / "plain" / "one.py").write_text("k = 4")
    imports = "import parts.filters\nfrom parts import gain\nfrom plain.one import k\nfrom .later import answer"
    assert find(write(tmp_path, imports, "(parts.filters.k, gain.k, k, answer)")).value == (3, 3, 4, 1)


def test_modules_imported_by_name_and_pickles(tmp_path: Path) -> None:
    imports = "import importlib, pickle\nhelper = importlib.import_module('helper')"
    value = "(helper.x, pickle.loads(b'chelper\\nOne\\n.') is helper.One)"
    specs = [write(tmp_path / n, imports, value, helper=f"x = {n}\nclass One: ...") for n in "12"]
    assert [find(spec).value for spec in specs] == [(1, True), (2, True)]
    assert "helper" not in sys.modules


KERNEL = "from numba import njit\n@njit(cache=True)\ndef f(x):\n    print('ran')\n    return x + 1\n"


def test_compiled_neighbours_are_found_in_their_cache(tmp_path: Path) -> None:
    """By another process, after a change of the tracker's file, by another file, and after a move of the folder."""
    folder = tmp_path / "a"
    write(folder, "from kernel import f", "f(1)", kernel=KERNEL)
    shown = "from tracking.running.tracker_registry import find; import sys; print(find(sys.argv[1]).value)"
    root = str(Path(tracking.__file__).parents[1])

    def value(spec: str) -> str:
        command = [sys.executable, "-c", shown, spec]
        return subprocess.run(command, env={"PYTHONPATH": root}, capture_output=True, text=True, check=True).stdout

    assert value(f"{folder}/mine.py:Mine") == "ran\n2\n"
    write(folder, "from kernel import f", "f(2)")
    assert value(f"{folder}/mine.py:Mine") == "ran\n3\n"
    (folder / "mine.py").rename(folder / "other.py")
    assert value(f"{folder}/other.py:Mine") == "ran\n3\n"
    folder.rename(tmp_path / "b")
    assert value(f"{tmp_path}/b/other.py:Mine") == "ran\n3\n"


def test_a_class_of_a_script_uses_the_script_and_what_it_imports(tmp_path: Path) -> None:
    write(tmp_path, "import helper, later", "0", helper="x = 1")
    script = tmp_path / "mine.py"
    script.write_text(script.read_text() + "from tracking.running.used_files import used\nprint(*used(Mine))\n")
    env = {"PYTHONPATH": str(Path(tracking.__file__).parents[1])}
    done = subprocess.run([sys.executable, script], env=env, capture_output=True, text=True, check=True)
    assert {Path(name).name for name in done.stdout.split()} == {"mine.py", "helper.py", "later.py", "packages"}


def test_a_module_of_a_package_that_has_changed_is_refused(tmp_path: Path, monkeypatch) -> None:
    """Python keeps what it has imported; answers of the old code would be stored as those of the new."""
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("wE_mine", "wE_base"):  # they are no longer imported after the test
        monkeypatch.setitem(sys.modules, name, None)
        del sys.modules[name]
    write(tmp_path, "from wE_base import x", "x", wE_base="x = 1")
    (tmp_path / "mine.py").rename(tmp_path / "wE_mine.py")
    assert find("wE_mine:Mine").value == 1
    (tmp_path / "wE_mine.py").write_text((tmp_path / "wE_mine.py").read_text() + "# changed")
    with pytest.raises(InputError, match=r"wE_mine.py: got another content than when wE_mine was imported; .*anew"):
        find("wE_mine:Mine")
    command = [sys.executable, "-c", "from tracking.running.tracker_registry import find; print(find('wE_mine:Mine'))"]
    env = {"PYTHONPATH": f"{Path(tracking.__file__).parents[1]}:{tmp_path}"}
    assert "Mine" in subprocess.run(command, env=env, capture_output=True, text=True, check=True).stdout


def test_a_function_of_the_file_reaches_a_process_that_knows_nothing_of_it(tmp_path: Path) -> None:
    """As multiprocessing's spawn and joblib send it; the pool waited for ever for a worker that could not import it."""
    for stem in ("mine", "mine.v2"):
        write(tmp_path, "import tracking\ndef double(x): return 2 * x * tracking.mine()", "1", tracking=OWN)
        (tmp_path / "mine.py").rename(tmp_path / f"{stem}.py")
        function = sys.modules[find(f"{tmp_path}/{stem}.py:Mine").__module__].double
        code = "import pickle, sys; print(pickle.loads(bytes.fromhex(sys.argv[1]))(3))"
        command = [sys.executable, "-c", code, pickle.dumps(function).hex()]
        env = {"PYTHONPATH": str(Path(tracking.__file__).parents[1])}
        assert subprocess.run(command, env=env, capture_output=True, text=True, check=True).stdout == "42\n"
