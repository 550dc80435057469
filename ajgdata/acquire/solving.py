"""Solvers of scenes: in this process, or in several that work ahead of whoever asks."""

from __future__ import annotations

import multiprocessing
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Protocol

from ajgdata import gripper
from ajgdata.acquire.child import follow_parent
from ajgdata.store.responses import ResponseStore
from ajgdata.types import DataError

#: Scenes that each process has before it: none waits, and few responses lie in memory.
AHEAD = 3


class Solver(Protocol):
    """Scene -> impulse response."""

    @property
    def solved(self) -> int:
        """Scenes that were simulated so far; the responses of others were kept from before."""
        ...

    def expect(self, scenes: Sequence[gripper.Scene]) -> None:
        """Hear which scenes will be asked for, in which order."""
        ...

    def solve(self, scene: gripper.Scene) -> gripper.ImpulseResponse:
        """Return the response of a scene. Raises gripper.SceneError."""
        ...


class SerialSolver:
    """Solves each scene when it is asked for, in this process."""

    def __init__(self, folder: Path) -> None:
        self._store = ResponseStore(folder)

    @property
    def solved(self) -> int:
        """Scenes that were simulated so far (see Solver)."""
        return self._store.solved

    def expect(self, scenes: Sequence[gripper.Scene]) -> None:
        """Nothing is done ahead."""

    def solve(self, scene: gripper.Scene) -> gripper.ImpulseResponse:
        """Return the response of a scene. Raises gripper.SceneError."""
        return self._store.solve(scene)


class PoolSolver:
    """Solves the scenes that are expected in processes, a few ahead of who asks.

    The order in which they finish changes nothing: each scene has one response.
    """

    def __init__(self, folder: Path, pool: ProcessPoolExecutor, count: int) -> None:
        self._folder, self._pool, self._most = folder, pool, AHEAD * count
        self._waiting: deque[gripper.Scene] = deque()
        self._ahead: dict[str, Future[tuple[gripper.ImpulseResponse, int]]] = {}
        self.solved = 0

    def expect(self, scenes: Sequence[gripper.Scene]) -> None:
        """Begin with the first of `scenes`; what was expected before and not asked for is left."""
        for future in self._ahead.values():
            future.cancel()
        self._ahead.clear()
        self._waiting = deque(scenes)
        with _whole():
            self._fill()

    def solve(self, scene: gripper.Scene) -> gripper.ImpulseResponse:
        """Wait for the response of `scene`. DataError if a process was ended from outside."""
        with _whole():
            self._submit(scene)
            future = self._ahead.pop(gripper.scene_digest(scene))
            self._fill()
            response, solved = future.result()
            self.solved += solved
            return response

    def _fill(self) -> None:
        while self._waiting and len(self._ahead) < self._most:
            self._submit(self._waiting.popleft())

    def _submit(self, scene: gripper.Scene) -> None:
        digest = gripper.scene_digest(scene)
        if digest not in self._ahead:
            self._ahead[digest] = self._pool.submit(_solve, self._folder, scene)


@contextmanager
def _whole() -> Iterator[None]:
    """Say in one line that a process is gone; the pool notices it at any of its calls."""
    try:
        yield
    except BrokenProcessPool:
        raise DataError(
            "solving scenes",
            "a process was ended from outside, perhaps for want of memory",
            "go on with fewer --cores",
        ) from None


@contextmanager
def solving(folder: Path, cores: int) -> Iterator[Solver]:
    """Yield a solver that keeps its responses in `folder`, with `cores` processes (1: this one).

    The processes end with this one, whatever becomes of it.
    """
    if cores == 1:
        yield SerialSolver(folder)
        return
    context = multiprocessing.get_context("spawn")  # forking would copy threads in any state
    pool = ProcessPoolExecutor(cores, mp_context=context, initializer=follow_parent)
    try:
        yield PoolSolver(folder, pool, cores)
    finally:
        pool.shutdown(cancel_futures=True)


@cache
def _store(folder: Path) -> ResponseStore:
    return ResponseStore(folder)


def _solve(folder: Path, scene: gripper.Scene) -> tuple[gripper.ImpulseResponse, int]:
    """Return the response of a scene, and 1 if it had to be simulated."""
    store = _store(folder)
    before = store.solved
    return store.solve(scene), store.solved - before
