"""Templates of every page: text escaped, undefined variables refused, numbers and symbols in one notation."""

from __future__ import annotations

import contextlib
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from markupsafe import Markup

from aerosid import notation
from aerosid.compiled.user_folder import made_user_folder
from aerosid.flight_model.terms import Factor
from aerosid.reporting import prose, words
from aerosid.reporting.result_json import portable

if TYPE_CHECKING:
    from jinja2 import BytecodeCache, Environment

REPORT_TEMPLATES = Path(__file__).parent / "templates"


def page_style() -> Markup:
    """The style sheet included in every page; safe, since it is part of the package."""
    return Markup((REPORT_TEMPLATES / "style.css").read_text(encoding="utf-8"))


def _compiled_templates() -> BytecodeCache | None:
    """Compiled templates, stored with the compiled kernels: compiling them takes as long as filling them."""
    from jinja2 import FileSystemBytecodeCache
    from jinja2.bccache import Bucket

    class Kept(FileSystemBytecodeCache):
        def dump_bytecode(self, bucket: Bucket) -> None:
            with contextlib.suppress(OSError):  # a full or read-only disk is not an error
                super().dump_bytecode(bucket)

    folder = made_user_folder("templates")
    return None if folder is None else Kept(str(folder))


@cache
def page_environment(folder: Path) -> Environment:
    """The templates of a folder, with the filters shared by all pages."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(folder),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        bytecode_cache=_compiled_templates(),
    )
    environment.filters.update(
        number=notation.number,
        deviation=notation.with_deviation,
        p_value=notation.p_value,
        hundredths=lambda value: notation.decimals(value, 2),
        ratio=words.ratio,
        share=notation.share,
        symbol=symbol_html,
        term=term_html,
        effect=words.effect_sentence,
        short_effect=words.short_effect,
        shown=_shown,
        plain=notation.plain,
        sentence=words.sentence,
        si=notation.si_unit,
        lag_one=lambda values: notation.number(values[1] if len(values) > 1 else None, 2),
        prose=prose.prose,
        words=lambda name: name.lower().replace("_", " "),
        quantity=words.quantity,
        portable=portable,
        unit=lambda unit: words.shown_unit(unit).text,
    )
    return environment


def symbol_html(name: str) -> Markup:
    """A name as its symbol, with a subscript; escaped."""
    base, subscript = words.symbol(name)
    lowered = Markup("<sub>{}</sub>").format(subscript) if subscript else Markup("")
    return Markup("<var>{}{}</var>").format(base, lowered)


def term_html(text: str) -> Markup:
    """A term as a formula: `alpha^2` is α²; a text that is not a term is kept; escaped."""
    factors = words.factors_of(text)
    if factors is None:
        return Markup("{}").format(text)
    if not factors:
        return Markup("1")
    return Markup('<span class="formula">{}</span>').format(Markup("·").join(map(_factor_html, factors)))


def _factor_html(factor: Factor) -> Markup:
    body = symbol_html(factor.variable)
    if factor.shape == "abs":
        body = Markup("|{}|").format(body)
    elif factor.shape == "pos":
        sign = "−" if factor.offset >= 0.0 else "+"
        inner = body if factor.offset == 0.0 else Markup("{} {} {:g}").format(body, sign, abs(factor.offset))
        body = Markup("pos({})").format(inner)
    return body if factor.power == 1 else Markup("{}<sup>{}</sup>").format(body, factor.power)


def _shown(value: float | None, unit: str, digits: int = 2) -> str:
    """An SI number in the unit shown on the page."""
    return notation.number(None if value is None else value * words.shown_unit(unit).factor, digits)
