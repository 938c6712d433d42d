"""What was made lately, as much of it as fits."""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from threading import Lock
from typing import Any, TypeVar

Value = TypeVar('Value', bound=tuple[Any, ...])

EACH = 300  # bytes of an entry beside its arrays, about


class Latest:
    """Tuples of arrays, by a key; the least lately asked for are let go of; threads may share it.

    Args:
        most_bytes: of the arrays, about; what is in use may be more.
    """

    def __init__(self, most_bytes: int) -> None:
        self.most_bytes = most_bytes
        self.bytes = self.made = 0  # bytes that are kept, and that ever were
        self._kept: OrderedDict[Hashable, tuple[Any, ...]] = OrderedDict()
        self._lock = Lock()

    def get(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Return what is kept, or what make returns: made outside the lock, always the same."""
        with self._lock:
            if (kept := self._kept.get(key)) is not None:
                self._kept.move_to_end(key)
                return kept  # pyright: ignore[reportReturnType]  # what make returned under it
        value = make()
        with self._lock:
            if key not in self._kept:
                self._kept[key] = value
                self.bytes += _size(value)
                self.made += _size(value)
            while self.bytes > self.most_bytes and len(self._kept) > 1:
                self.bytes -= _size(self._kept.popitem(last=False)[1])
        return value

    def has(self, key: Hashable) -> bool:
        """Whether it is kept; asks for nothing."""
        with self._lock:
            return key in self._kept


def _size(value: tuple[Any, ...]) -> int:
    arrays = {id(each): int(each.nbytes) for each in value}  # one may stand twice
    return EACH + sum(arrays.values())
