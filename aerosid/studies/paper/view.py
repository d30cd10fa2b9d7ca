"""Views of tables: words and formatted numbers of the page."""

from __future__ import annotations

from dataclasses import dataclass

from aerosid.notation import decimals


@dataclass(frozen=True)
class TableView:
    """A table as text.

    Attributes
    ----------
    title : str
    header : tuple of str
    rows : tuple of tuple of str
    notes : tuple of str
        The procedure, and the reasons for differences from the printed numbers; one paragraph each.
    """

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...]


_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def number(value: float | None, digits: int = 6, given: str = "given") -> str:
    """A number with so many decimals, or the word for None."""
    return given if value is None else decimals(value, digits)


def scientific(value: float) -> str:
    """A small number as a power of ten."""
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa}·10{str(int(exponent)).translate(_SUPERSCRIPT)}"
