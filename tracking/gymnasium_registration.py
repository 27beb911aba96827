"""Making `flockscope/Tuning-v0` known to Gymnasium without importing Gymnasium, which takes longer than all of ours.

Where it is there already the environment is registered at once, else in the moment in which it has been imported.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

ID = "flockscope/Tuning-v0"
LIBRARY = "gymnasium"


def announce() -> None:
    """Register the environment now or as soon as there is something to register it with; once, however often asked."""
    if hasattr(sys.modules.get(LIBRARY), "register"):
        _register()
    elif not any(isinstance(finder, _Waiting) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Waiting())


def _register() -> None:
    import gymnasium

    if ID not in gymnasium.registry:
        gymnasium.register(ID, entry_point="tracking.environment.env:TuningEnv")


class _Waiting(MetaPathFinder):
    """Finds nothing itself: when the library is looked for, what will load it is told to register afterwards."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname != LIBRARY:
            return None
        others = [finder for finder in sys.meta_path if not isinstance(finder, _Waiting)]
        specs = (finder.find_spec(fullname, path, target) for finder in others)
        spec = next((found for found in specs if found is not None), None)
        if spec is None or spec.loader is None:
            return spec
        load = spec.loader.exec_module

        def load_and_register(module: ModuleType) -> None:
            load(module)
            sys.meta_path[:] = [finder for finder in sys.meta_path if finder is not self]
            _register()

        spec.loader.exec_module = load_and_register  # type: ignore[method-assign]
        return spec
