"""Attributes of code that are replaced for a while, to measure a rule that has no parameter."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from unittest import mock

# Owner, name and value of an attribute.
Replacement = tuple[object, str, object]


@contextmanager
def replaced_code(changes: Iterable[Replacement]) -> Iterator[None]:
    """Replaces attributes within the context."""
    with ExitStack() as stack:
        for owner, name, value in changes:
            stack.enter_context(mock.patch.object(owner, name, value))
        yield
