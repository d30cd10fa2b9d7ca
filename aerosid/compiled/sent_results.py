"""Results on their way between copies of one process, which have most of what they are made of in common."""

from __future__ import annotations

import io
import marshal
import pickle
import sys
from collections.abc import Callable, Sequence
from types import CellType, FunctionType
from typing import Any

NOT_SENT = (pickle.PicklingError, TypeError, AttributeError, ValueError, LookupError, ImportError, RuntimeError)
"""What is raised where something cannot be sent, or not be made again where it arrives; a recursion among them."""


def packed(result: object, common: Sequence[object] = ()) -> bytes:
    """A result as it is sent.

    Parameters
    ----------
    result : object
        Functions defined inside others, which effects hold, are sent with what they enclose.
    common : sequence of object
        What both processes have; where the result holds one of them, its place is sent.

    Raises
    ------
    NOT_SENT
        Where something in it cannot be sent.
    """
    room = io.BytesIO()
    _Packer(room, common).dump(result)
    return room.getvalue()


def unpacked(sent: bytes, common: Sequence[object] = ()) -> Any:
    """The result again, with this process's own of what both have."""
    return _Unpacker(io.BytesIO(sent), common).load()


class _Packer(pickle.Pickler):
    def __init__(self, room: io.BytesIO, common: Sequence[object]) -> None:
        super().__init__(room, pickle.HIGHEST_PROTOCOL)
        self._places = {id(each): place for place, each in enumerate(common)}

    def persistent_id(self, obj: object) -> int | None:
        return self._places.get(id(obj))

    def reducer_override(self, obj: object) -> Any:
        if not isinstance(obj, FunctionType) or "<locals>" not in obj.__qualname__:
            return NotImplemented
        enclosed = [cell.cell_contents for cell in obj.__closure__ or ()]
        names = obj.__module__, obj.__name__, obj.__qualname__
        return _inner_function, (names, marshal.dumps(obj.__code__), obj.__defaults__, obj.__kwdefaults__, enclosed)


class _Unpacker(pickle.Unpickler):
    def __init__(self, room: io.BytesIO, common: Sequence[object]) -> None:
        super().__init__(room)
        self._common = common

    def persistent_load(self, pid: int) -> object:
        return self._common[pid]


def _inner_function(
    names: tuple[str, str, str],
    code: bytes,
    defaults: tuple[object, ...] | None,
    named: dict[str, object] | None,
    enclosed: Sequence[object],
) -> Callable[..., Any]:
    """A function defined inside another, of the same code with what it encloses."""
    module, name, qualified = names
    cells = tuple(CellType(content) for content in enclosed)
    made = FunctionType(marshal.loads(code), vars(sys.modules[module]), name, defaults, cells)
    made.__kwdefaults__, made.__module__, made.__qualname__ = named, module, qualified
    return made
