"""Bounds check of a MATLAB 5 file's data elements, before scipy follows their lengths outside the file's memory."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from math import prod
from typing import Literal

_HEADER = 128
"""Format: bytes of the file's header."""

_MATRIX, _COMPRESSED = 14, 15
"""Format: types of elements that contain an array, or compressed elements."""

# Bytes of one number by the element's type: miINT8 to miUTF32 of the MAT-File Format.
_SIZES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
"""Format: bytes of one number by the element's type, miINT8 to miUTF32."""

_CELL, _STRUCT, _CHAR = 1, 2, 4
"""Format: classes of arrays of arrays, of structs and of text."""

_NUMBERS = range(6, 16)  # classes mxDOUBLE to mxUINT64
_WITHOUT_SIZES = (16, 17)
"""Format: classes of functions and of objects of newer kind."""

_DEEPEST = 50
"""Format: maximum depth of arrays within arrays."""

_LONGEST = 2**28
"""Format: maximum number of values of one array."""


class DamagedElement(ValueError):
    """An element inconsistent with its own tag or with its neighbours; the message is a clause."""


@dataclass(frozen=True)
class _Element:
    kind: int
    body: bytes
    after: int


def check_elements(data: bytes) -> None:
    """None; checks that every element lies within its parent and an array's sizes agree with its data.

    Parameters
    ----------
    data : bytes
        A whole file, header included.

    Raises
    ------
    DamagedElement
        Otherwise.

    Notes
    -----
    MathWorks, MAT-File Format (2024), chapter 1. scipy 1.17.1 follows wrong tags out of the file's memory.
    """
    order: Literal["little", "big"] = "little" if data[126:128] == b"IM" else "big"
    place = _HEADER
    while place + 8 <= len(data):
        element = _element(data, place, order)
        if element.kind == _COMPRESSED:
            try:
                inner = zlib.decompress(element.body)
            except zlib.error:
                raise DamagedElement("a compressed variable does not unpack") from None
            element = _Element(element.kind, inner, place + 8 + len(element.body))
            held = _element(inner, 0, order)
            _check_array(held, order, 0)
        elif element.kind == _MATRIX:
            _check_array(element, order, 0)
        else:
            raise DamagedElement(f"a variable has the type {element.kind}")
        place = element.after
    if place < len(data):
        raise DamagedElement(f"{len(data) - place} bytes follow the last variable")


def _element(data: bytes, place: int, order: Literal["little", "big"]) -> _Element:
    """The element at an offset; small elements have type, length and up to four bytes in eight."""
    if place + 8 > len(data):
        raise DamagedElement("it ends inside an element")
    word = int.from_bytes(data[place : place + 4], order)
    small = word >> 16
    if small:
        if small > 4:
            raise DamagedElement("a short element is too long")
        return _Element(word & 0xFFFF, data[place + 4 : place + 4 + small], place + 8)
    length = int.from_bytes(data[place + 4 : place + 8], order)
    if place + 8 + length > len(data):
        raise DamagedElement("an element is longer than what holds it")
    padding = 0 if word == _COMPRESSED else -length % 8
    return _Element(word, data[place + 8 : place + 8 + length], place + 8 + length + padding)


def _numbers(element: _Element, order: Literal["little", "big"]) -> list[int]:
    return [int.from_bytes(element.body[k : k + 4], order, signed=True) for k in range(0, len(element.body), 4)]


def _check_array(element: _Element, order: Literal["little", "big"], depth: int) -> None:
    """One array: its flags, sizes and name, and the data required by its class."""
    if element.kind != _MATRIX or depth > _DEEPEST:
        raise DamagedElement("an array was expected")
    body = element.body
    if not body:  # an empty cell
        return
    flags = _element(body, 0, order)
    if (flags.kind, len(flags.body)) != (6, 8):
        raise DamagedElement("an array has no flags")
    word = int.from_bytes(flags.body[:4], order)
    kind = word & 0xFF
    if kind in _WITHOUT_SIZES:
        _check_parts(body, flags.after, order, depth)
        return
    sizes = _element(body, flags.after, order)
    name = _element(body, sizes.after, order)
    if sizes.kind not in (5, 6) or name.kind not in (1, 16):
        raise DamagedElement("an array has no sizes or name")
    shape = _numbers(sizes, order)
    if len(sizes.body) % 4 or not 2 <= len(shape) <= 32 or min(shape) < 0 or prod(shape) > _LONGEST:
        raise DamagedElement("an array has impossible sizes")
    place = name.after
    if kind in _NUMBERS or kind == _CHAR:
        for _ in range(2 if word & 0x0800 else 1):
            part = _element(body, place, order)
            size = _SIZES.get(part.kind)
            exact = kind != _CHAR
            if size is None or len(part.body) % size or (exact and len(part.body) != size * prod(shape)):
                raise DamagedElement("an array does not hold as many values as it declares")
            place = part.after
        return
    if kind == _STRUCT:
        length = _element(body, place, order)
        names = _element(body, length.after, order)
        width = _numbers(length, order)
        if length.kind != 5 or len(width) != 1 or width[0] < 1 or names.kind != 1 or len(names.body) % width[0]:
            raise DamagedElement("a struct has no field names")
        place, count = names.after, prod(shape) * (len(names.body) // width[0])
    elif kind == _CELL:
        count = prod(shape)
    else:
        _check_parts(body, place, order, depth)
        return
    for _ in range(count):
        inner = _element(body, place, order)
        _check_array(inner, order, depth + 1)
        place = inner.after


def _check_parts(body: bytes, place: int, order: Literal["little", "big"], depth: int) -> None:
    """Checks the elements of a sparse array, an object or a function, one after the other; they are no channels."""
    while place < len(body):
        part = _element(body, place, order)
        if part.kind == _MATRIX:
            _check_array(part, order, depth + 1)
        elif part.kind not in _SIZES:
            raise DamagedElement(f"an element has the type {part.kind}")
        place = part.after
