"""Compiled programs in memory: one store with a bound, from which the least recently
used programs go.

Each program holds memory, mostly XLA's description of it, and memory mappings for its
code, of which Linux allows a process 65,530. The bound of the memory holds both: 150
structures one after the other, each simulated, printed and partly differentiated, took
at most 740 MB and 3,000 mappings.
"""

import contextlib
import ctypes
import functools
import gc
import itertools
import operator
import os
import threading
from collections import deque
from collections.abc import Callable, Hashable
from typing import Any, TypeAlias, TypeVar

import jax

_Value = TypeVar("_Value")
#: who made a program, and for what
Key: TypeAlias = tuple[Hashable, ...]

MEMORY_VARIABLE = "SIMBRAKE_PROGRAM_MEMORY"
#: MB that programs may take
DEFAULT_MEMORY = 320.0
#: MB that a line of StableHLO takes in a compiled program; 4.1 to 7.9 kB in those of
#: seven scenes (JAX 0.10.2)
_PER_LINE = 0.005
#: a pressed store goes down to this share of its bound, so that it is not pressed by
#: the next program again
_LOWER = 0.75


_lines = operator.attrgetter("lines")


def memory_bound() -> float:
    """MB that all programs together may take; looked up when a program is made."""
    try:
        return max(0.0, float(os.environ.get(MEMORY_VARIABLE, DEFAULT_MEMORY)))
    except ValueError:
        return DEFAULT_MEMORY


@functools.cache
def _trim() -> Callable[[int], Any]:
    """Function of the C library that gives freed memory back to the system, where there
    is one (glibc)."""
    try:
        return ctypes.CDLL(None).malloc_trim
    except (OSError, AttributeError, TypeError):
        return int


class _Entry:
    __slots__ = ("megabytes", "used", "value")

    def __init__(self, value: Any, megabytes: float) -> None:
        self.value = value
        self.megabytes = megabytes
        self.used = 0


class Store:
    """Programs by key, as many as the bound allows.

    A program that has gone is made again when it is next asked for. Whoever holds one
    (a `Prepared`, a run in another thread) keeps it alive. `made` counts the programs
    made so far.
    """

    def __init__(self) -> None:
        self._entries: dict[Key, _Entry] = {}
        self._clock = itertools.count(1)
        self._gates: dict[Key, Any] = {}
        self._lock = threading.RLock()
        #: owners that are gone; the garbage collector adds them at any time, even while
        #: the store is changed
        self._dead: deque[Hashable] = deque()
        #: MB that have gone since JAX's caches were cleared
        self._gone = 0.0
        self.made = 0

    def __len__(self) -> int:
        return len(self._entries)

    @property
    def memory(self) -> float:
        """MB that the programs take, estimated."""
        return sum(entry.megabytes for entry in list(self._entries.values()))

    def get(
        self,
        key: Key,
        make: Callable[[], _Value],
        lines: Callable[[_Value], int] = _lines,
    ) -> _Value:
        """Return the program of a key, made where there is none; of several threads one
        makes it, the others wait.

        `lines(program)`: its length in lines of StableHLO, from which its memory is
        estimated.
        """
        entry = self._entries.get(key)
        if entry is None:
            entry = self._made(key, make, lines)
        entry.used = next(self._clock)
        return entry.value

    def _made(
        self, key: Key, make: Callable[[], Any], lines: Callable[[Any], int]
    ) -> _Entry:
        with self._gates.setdefault(key, threading.RLock()):
            entry = self._entries.get(key)
            if entry is None:
                value = make()
                entry = _Entry(value, _PER_LINE * lines(value))
                entry.used = next(self._clock)
                with self._lock:
                    self._entries[key] = entry
                    self.made += 1
                    self._hold_bounds()
        self._gates.pop(key, None)
        return entry

    def forget(self, owner: Hashable = None) -> None:
        """Drop the programs whose keys begin with the owner, or all."""
        with self._lock:
            for key in [
                key for key in self._entries if owner is None or key[0] is owner
            ]:
                self._drop(key)

    def bury(self, owner: Hashable) -> None:
        """Drop the programs of an owner soon; to be called by the garbage collector."""
        self._dead.append(owner)

    def _drop(self, key: Key) -> None:
        entry = self._entries.pop(key)
        self._gone += entry.megabytes
        clear = getattr(
            entry.value, "clear_cache", None
        )  # a jitted function, with programs of JAX
        if clear is not None:
            clear()

    def _hold_bounds(self) -> None:
        """Drop what exceeds the bound, the least recently used first; the last one
        stays."""
        with contextlib.suppress(IndexError):
            while True:
                self.forget(self._dead.popleft())
        bound = memory_bound()
        if self.memory > bound:
            for key in sorted(self._entries, key=lambda key: self._entries[key].used)[
                :-1
            ]:
                if self.memory <= _LOWER * bound:
                    break
                self._drop(key)
            _trim()(0)
        if self._gone > bound:
            # JAX keeps what was traced for them, some MB for each structure, and
            # programs of single operations
            jax.clear_caches()
            gc.collect()
            _trim()(0)
            self._gone = 0.0


#: of the process
STORE = Store()


class Kept:
    """A function of arguments that can be hashed to a program, which the store keeps
    for each set of them.

    - `lines(program)`: as for `Store.get`
    - `made`: how many programs were made
    """

    def __init__(
        self, make: Callable[..., Any], *, lines: Callable[[Any], int] = _lines
    ) -> None:
        functools.update_wrapper(self, make)
        self._make = make
        self._lines = lines
        self.made = 0

    def __call__(self, *arguments: Hashable) -> Any:
        return STORE.get(
            (self, *arguments), functools.partial(self._one, arguments), self._lines
        )

    def _one(self, arguments: tuple[Hashable, ...]) -> Any:
        self.made += 1
        return self._make(*arguments)

    def cache_clear(self) -> None:
        STORE.forget(self)
