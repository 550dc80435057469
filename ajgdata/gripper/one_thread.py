"""Linear algebra of small matrices on one thread.

Threads of BLAS wait for one another by spinning: on a busy machine they cost more time than the
products themselves, and their number changes how sums round.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache

from threadpoolctl import ThreadpoolController


@cache
def _libraries() -> ThreadpoolController:
    return ThreadpoolController()


def one_thread() -> AbstractContextManager[object]:
    """Return a context in which BLAS and LAPACK of this process use one thread."""
    context: AbstractContextManager[object] = _libraries().limit(limits=1, user_api="blas")
    return context
