"""Independent evaluations of compiled kernels dealt out to threads, one a core; the results are those of one core.

Kernels hold no global lock. For tasks of a millisecond that mostly run in them a thread costs a hundredth of what a
copy of the process does (`cores.mapped`); tasks that mostly run in Python gain nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from aerosid.compiled.cores import allowed

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


def mapped_in_threads(task: Callable[[_Item], _Result], items: Sequence[_Item]) -> list[_Result]:
    """The task's result of each item, in their order.

    Parameters
    ----------
    task : callable
        Changes nothing but caches, which may be filled twice. Inside it there is one core. Of what it raises, that of
        the first item is raised here.
    items : sequence
        Taken by the cores in turn, as each becomes free.
    """
    count = min(allowed(), len(items))
    if count < 2:
        return list(map(task, items))
    with ThreadPoolExecutor(count) as threads:
        return list(threads.map(task, items))
