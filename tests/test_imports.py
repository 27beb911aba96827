"""What an import brings along: `import sim, tracking, scenarios` and `--help` stay quick, scoring stays light."""

from __future__ import annotations

import pytest

from tests.processes import python

HEAVY = {
    "numpy", "scipy", "numba", "cv2", "pymunk", "pyarrow", "pydantic", "filterpy", "gymnasium", "av", "rich",
    "matplotlib", "optuna",
}  # fmt: skip
LIST = "print(*sorted({name.partition('.')[0] for name in sys.modules}))"


def loaded(code: str) -> set[str]:
    """Top-level packages in a fresh interpreter after `code`."""
    run = python("-c", f"import sys\n{code}\n{LIST}")
    assert run.returncode == 0, run.stderr
    return set(run.stdout.splitlines()[-1].split())


LOADED = [
    ("import sim, tracking, scenarios", set()),
    ("from tracking.app.cli import run\nassert run(['--help']) == 0", set()),
    ("from tracking.app.cli import run\nassert run(['track', '--help']) == 0", {"pydantic"}),
    ("from tracking import evaluate", {"numpy", "scipy"}),
]


@pytest.mark.parametrize(("code", "needed"), LOADED)
def test_no_more_is_loaded_than_is_needed(code, needed):
    assert loaded(code).isdisjoint(HEAVY - needed)


def test_a_listing_of_scenarios_does_without_arrays_of_the_world():
    found = loaded("from tracking.app.cli import run\nrun(['scenarios', '--json'])")
    assert found.isdisjoint({"numba", "cv2", "pymunk", "pyarrow"})


LAZY_NAMES = [
    ("sim", ["replay", "simulate"]),
    ("scenarios", ["load", "sensor_settings"]),
    ("tracking", ["Live", "compare", "evaluate", "group", "track", "tune"]),
]


@pytest.mark.parametrize(("package", "names"), LAZY_NAMES)
def test_lazy_names(package, names):
    module = __import__(package)
    assert sorted(module.__all__) == names
    for name in names:
        assert callable(getattr(module, name)), f"{package}.{name}"
    with pytest.raises(AttributeError, match=f"module '{package}' has no attribute 'nothing'"):
        _ = module.nothing
