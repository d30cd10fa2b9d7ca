"""One thread for products of matrices while the block runs."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator


@contextlib.contextmanager
def one_blas_thread() -> Iterator[None]:
    """Holds numpy's and scipy's linear algebra to one thread; what was set before holds again afterwards.

    Matrices are small here. A second thread of a product has to wait where another process holds the core, which has
    made products of 20 us take 8 ms, and it may add in another order.
    """
    import threadpoolctl

    with threadpoolctl.threadpool_limits(limits=1, user_api="blas"):
        yield
