"""Tells Gymnasium of the worlds, once it is imported.

Importing surefoot imports no Gymnasium, which takes longer than all of surefoot and starts a thread.
"""

import importlib.abc
import importlib.util
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec
from types import ModuleType


def register_environments() -> None:
    """Registers the worlds; they are imported when the first of them is made."""
    from gymnasium.envs.registration import register

    for name in ("RockField", "Arena", "Terrain"):
        world = f"surefoot.environments:{name}"
        register(f"surefoot/{name}-v0", entry_point=world, vector_entry_point=f"{world}Vector")


class _Telling(importlib.abc.Loader):
    """Loads Gymnasium as it would be loaded, and registers the worlds then."""

    def __init__(self, loader: importlib.abc.Loader) -> None:
        self.loader = loader

    def create_module(self, spec: ModuleSpec) -> ModuleType | None:
        return self.loader.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        # What the package looks up by its loader, it finds by its own.
        module.__loader__ = self.loader
        if module.__spec__ is not None:
            module.__spec__.loader = self.loader
        self.loader.exec_module(module)
        register_environments()


class _Awaiting(importlib.abc.MetaPathFinder):
    """Waits for the import of Gymnasium, once."""

    def find_spec(
        self, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if name != "gymnasium":
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        if spec is not None and spec.loader is not None:
            spec.loader = _Telling(spec.loader)
        return spec


def register_with_gymnasium() -> None:
    """Registers now where Gymnasium is imported already, else as soon as it is."""
    if sys.modules.get("gymnasium") is None:
        sys.meta_path.insert(0, _Awaiting())
    else:
        register_environments()
