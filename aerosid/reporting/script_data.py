"""Data of scripts inside a page."""

from __future__ import annotations


def safe_inside_element(json_text: str) -> str:
    """JSON that ends neither the element it stands in nor, read as a script, a line: the same data, no `<`."""
    return json_text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
