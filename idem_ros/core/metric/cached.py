"""What is computed once and kept, for threads that share it."""

from collections.abc import Callable, Hashable
from threading import Lock
from typing import Any, TypeVar

Value = TypeVar('Value')


class Kept:
    """Results of a cloud by kind and key, the latest few of each kind: all that is kept."""

    def __init__(self, most: int) -> None:
        self.most = most
        self._found: dict[str, dict[Hashable, Any]] = {}
        self._lock = Lock()

    def get(self, kind: str, key: Hashable, make: Callable[[], Value]) -> Value:
        """Return what was kept, or what make returns: made outside the lock, to the same bits."""
        with self._lock:
            of_kind = self._found.setdefault(kind, {})
            if key in of_kind:
                return of_kind[key]
        value = make()
        with self._lock:
            value = of_kind.setdefault(key, value)
            while len(of_kind) > self.most:
                of_kind.pop(next(iter(of_kind)))
        return value

    def has(self, kind: str, key: Hashable) -> bool:
        """Whether it is kept."""
        with self._lock:
            return key in self._found.get(kind, {})
