"""Texts within a paragraph, in the markup of reportlab's paragraphs."""

from __future__ import annotations

import html
import re

from aerosid.reporting.paper.elements import Element

_TAGS = {"b": "b", "i": "i", "var": "i", "sub": "sub", "sup": "super", "strong": "b", "em": "i", "s": "strike"}
_SHIFTED = {"sub": ' rise="18%" size="72%"', "super": ' rise="35%" size="72%"'}
"""Display: shift and size of sub- and superscripts; reportlab's usual half em overlaps the next line."""
_BLANKS = re.compile(r"[ \t\r\n]+")


def markup(element: Element) -> str:
    """The contents of the element; every text is escaped, pictures are left out."""
    return _BLANKS.sub(" ", "".join(map(_part, element.children))).strip()


def printable(text: str) -> str:
    """The text with characters that UTF-8 cannot encode written out: a path on disk may be any bytes."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def escaped(text: str) -> str:
    """The text with the three characters of markup as entities."""
    return html.escape(text, quote=False)


def _part(child: Element | str) -> str:
    if isinstance(child, str):
        return escaped(printable(child))
    if child.tag in ("svg", "input") or "on-screen" in child.classes:
        return ""
    if child.tag == "br":
        return "<br/>"
    inner = "".join(map(_part, child.children))
    if "tag" in child.classes:
        return f" ({inner.strip()})"
    tag = _TAGS.get(child.tag)
    return f"<{tag}{_SHIFTED.get(tag, '')}>{inner}</{tag}>" if tag and inner else inner
