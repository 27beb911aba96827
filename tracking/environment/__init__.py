"""The Gymnasium environment, its observations, and the episodes that searches play.

The environment `flockscope/Tuning-v0` is registered without an import of Gymnasium, which is slow. If Gymnasium is
imported already, the environment is registered at once. Else an import hook registers it as soon as somebody imports
Gymnasium.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

ID = "flockscope/Tuning-v0"
LIBRARY = "gymnasium"


def register_when_imported() -> None:
    """Registers the environment flockscope/Tuning-v0: now if Gymnasium is already imported, else when it is."""
    if hasattr(sys.modules.get(LIBRARY), "register"):
        _register()
    elif not any(isinstance(finder, _RegisteringFinder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _RegisteringFinder())


def _register() -> None:
    import gymnasium

    if ID not in gymnasium.registry:
        gymnasium.register(ID, entry_point="tracking.environment.env:TuningEnv")


class _RegisteringFinder(MetaPathFinder):
    """Import hook: makes the loader of Gymnasium register the environment after loading, then removes itself.

    It finds no modules itself: the other finders are asked.
    """

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname != LIBRARY:
            return None
        specs = (finder.find_spec(fullname, path, target) for finder in sys.meta_path if finder is not self)
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
