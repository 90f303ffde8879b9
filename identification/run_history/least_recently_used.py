"""What was worked out lately and is likely asked for again."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

T = TypeVar("T")


class LeastRecentlyUsed(Generic[T]):
    """Values by what they were made of; when there are more than `most`, the longest unused is forgotten.

    >>> import numpy as np
    >>> kept, a = LeastRecentlyUsed(most=8), np.arange(3.0)
    >>> kept("twice", lambda: 2 * a, a) is kept("twice", lambda: 2 * a, a)
    True
    >>> kept("twice", lambda: 2 * a, a.copy()) is kept("twice", lambda: 2 * a, a)
    False
    """

    def __init__(self, most: int) -> None:
        self.most = most
        self._known: OrderedDict[Hashable, tuple[T, tuple[object, ...]]] = OrderedDict()

    def __call__(self, key: Hashable, make: Callable[[], T], *of: object) -> T:
        """What `make` makes, of a `key` that is equal and of the very same objects `of`.

        They are kept too: as long as they are there, no other object has their address.
        """
        full = (key, *map(id, of))
        known = self._known.get(full)
        if known is None:
            known = self._known[full] = make(), of
            if len(self._known) > self.most:
                self._known.popitem(last=False)
        else:
            self._known.move_to_end(full)
        return known[0]
