"""What the page shows of a table: words and formatted numbers."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class TableView:
    """A table as text.

    Attributes
    ----------
    title : str
    header : tuple of str
    rows : tuple of tuple of str
    notes : tuple of str
        What was done, and why ours and the printed numbers differ; one paragraph each.
    """

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...]


def number(value: float | None, digits: int = 6, given: str = "given") -> str:
    """A number with so many digits after the point, or the word for none."""
    return given if value is None else f"{value:.{digits}f}".replace("-", "−")


def scientific(value: float) -> str:
    """A small number as a power of ten."""
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa}·10^{int(exponent)}".replace("-", "−")
