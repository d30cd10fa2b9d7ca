"""Texts within a paragraph, in the markup that reportlab's paragraphs read."""

from __future__ import annotations

import html
import re

from aerosid.reporting.paper.elements import Element

_TAGS = {"b": "b", "i": "i", "var": "i", "sub": "sub", "sup": "super", "strong": "b", "em": "i", "s": "strike"}
_SHIFTED = {"sub": ' rise="18%" size="72%"', "super": ' rise="35%" size="72%"'}
"""Display: shift and size of sub- and superscripts; the half em that is usual in reportlab runs into the next line."""
_BLANKS = re.compile(r"[ \t\r\n]+")


def markup(element: Element) -> str:
    """What stands in the element; every text is escaped, pictures are left out."""
    return _BLANKS.sub(" ", "".join(map(_part, element.children))).strip()


def printable(text: str) -> str:
    """The text with what UTF-8 cannot hold written out: a path on disk may be any bytes."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def escaped(text: str) -> str:
    """The text with the three characters that markup is made of as entities."""
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
