"""Options that take a number with a unit: `--amplitude 3deg`, `--airspeed 180kt`, `--altitude 5000ft`."""

from __future__ import annotations

from collections.abc import Callable


def in_unit(wanted: str) -> Callable[[str], float]:
    """The parser of an option: a bare number is in the unit of the option, any other is converted to it.

    Raises
    ------
    typer.BadParameter
        From the parser, where the text is not a number with a unit of that dimension: exit code 2.
    """

    def parsed(words: str | float) -> float:
        import typer

        from aerosid.logs.formats.quantity import read_quantity
        from aerosid.logs.formats.units import UnitProblem

        try:
            return read_quantity(str(words), wanted)
        except UnitProblem as problem:
            raise typer.BadParameter(
                f"{str(words)[:40]!r} {problem}; write it in {wanted}, or with its unit."
            ) from None

    return parsed
