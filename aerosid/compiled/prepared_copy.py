"""A copy of this process that readies itself for a task while what it works on is still being computed."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterator
from multiprocessing.connection import Pipe
from typing import Any, TypeVar

from aerosid.compiled.cores import Begun, allowed, copied, received

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")


@contextlib.contextmanager
def prepared(
    task: Callable[[_Item], _Result], ready: Callable[[], object]
) -> Iterator[Callable[[_Item], Callable[[], _Result]]]:
    """A task for a copy of this process that readies itself beside the block until it is given its item.

    Parameters
    ----------
    task : callable
        Of one item, which can be sent between processes as can its result; changes nothing but caches.
    ready : callable
        What the copy does at once, such as imports that this process does without.

    Returns
    -------
    context manager of callable
        Given the item, it hands it over; what that returns waits for the result. Without a second core, or where the
        copy fails, the task is done here when the result is asked for. A copy given nothing ends with the block.
    """
    if allowed() < 2 or sys.platform != "linux":
        yield lambda item: Begun(lambda: task(item))
        return
    asked, asking = Pipe(duplex=False)

    def work() -> dict[int, Any]:
        asking.close()
        ready()
        given = asked.recv()
        return {0: task(*given)} if given else {}

    place, results = copied(work)
    asked.close()

    def hand_over(item: _Item) -> Begun[_Result]:
        with contextlib.suppress(OSError):  # the copy has ended: its result will be missing
            asking.send((item,))
        return Begun(lambda: task(item), (place, results))

    try:
        yield hand_over
    finally:
        # Closing alone would not tell it: copies made since hold this end too, and may wait for this process.
        with contextlib.suppress(OSError):
            asking.send(())
        asking.close()
        if not results.closed:
            received(place, results)
