"""A matplotlib figure as SVG inside the page: with colours and fonts of the page's style sheet, and text as text.

Matplotlib has no style sheets, so figures are drawn with a stand-in colour for each role, which is replaced by a
variable of the page here, and with the role as the artist's gid, which becomes a class.
"""

from __future__ import annotations

import io
import re
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROLES = ("ink", "muted", "grid", "measured", "declared", "before", "after", "trimmed", "noise")
"""Classes and colour variables of style.css that figures may use."""

COLOURS = {role: f"#{i:02x}fe{i:02x}" for i, role in enumerate(ROLES, start=1)}
"""The stand-in colour of each role."""

FONT_SIZE = 8.0
"""Display: pt; printed at about this size on A4."""

_SETTINGS: Any = {
    "svg.fonttype": "none",  # text can be searched and read aloud, outlines cannot
    "svg.hashsalt": "aerosid",
    "path.simplify": True,
    "path.simplify_threshold": 1.0 / 9.0,
    "font.family": ["sans-serif"],
    "font.sans-serif": ["DejaVu Sans"],  # bundled with matplotlib: the layout is the same on every machine
    "font.size": FONT_SIZE,
    "text.usetex": False,
    "axes.unicode_minus": True,
    "axes.linewidth": 0.6,
    "axes.edgecolor": COLOURS["muted"],
    "axes.labelcolor": COLOURS["ink"],
    "axes.axisbelow": True,
    "text.color": COLOURS["ink"],
    "xtick.color": COLOURS["muted"],
    "ytick.color": COLOURS["muted"],
    "xtick.major.size": 0.0,
    "ytick.major.size": 0.0,
    "xtick.major.pad": 4.0,
    "ytick.major.pad": 3.0,
    "grid.color": COLOURS["grid"],
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.1,
}

_VARIABLES = {colour: f"var(--{role})" for role, colour in COLOURS.items()}
_COLOUR = re.compile("|".join(_VARIABLES))
_FONT_FAMILY = re.compile(r"font-family: [^;\"]*;? ?|font: [^;\"]*?px [^;\"]*;? ?")
_IDENTITY = re.compile(r' id="([^"]*)"')
_REFERENCE = re.compile(r'(?:xlink:href="|url\()#([^")]+)')
_DECIMALS = re.compile(r"(?<=\.\d\d)\d+")
_PATH = re.compile(r' d="([^"]*)"')
_PLACE = re.compile(r' (?:x|y|transform|width|height)="[^"]*"')
_SUBSCRIPT = re.compile(r"_\{(\w+)\}([^<]*)")
_DOT = re.compile(r"M([-\d.]+) ([-\d.]+)L\1 \2(?=M|$)")


@contextmanager
def drawing_style() -> Iterator[None]:
    """The settings under which figures are made and written, independent of the user's matplotlib settings."""
    import matplotlib as mpl

    with mpl.rc_context(_SETTINGS), warnings.catch_warnings():
        # A channel's name may contain a script that the layout font lacks; the browser has a font for it.
        warnings.filterwarnings("ignore", message="Glyph", category=UserWarning)
        yield


def inline_svg(figure: Figure, identity: str, label: str) -> Markup:
    """The figure as an `<svg>` element for the page.

    Parameters
    ----------
    figure : Figure
        Drawn with `COLOURS`; call it within `drawing_style`.
    identity : str
        Prefix of every id in it, different for each figure of a page.
    label : str
        Text alternative, for readers who cannot see it.
    """
    stream = io.StringIO()
    nothing: Mapping[str, None] = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    figure.savefig(stream, format="svg", metadata=dict(nothing), transparent=True)
    text = stream.getvalue()
    body = text[text.index(">", text.index("<svg")) + 1 : text.rindex("</svg>")]
    body = re.sub(r"<style.*?</style>", "", body, count=1, flags=re.DOTALL)
    body = _PATH.sub(lambda path: f' d="{_compact(path[1])}"', body)
    body = _PLACE.sub(lambda place: _DECIMALS.sub("", place[0]), body)
    body = _COLOUR.sub(lambda colour: _VARIABLES[colour[0]], _FONT_FAMILY.sub("", body))
    body = _SUBSCRIPT.sub(r'<tspan class="sub" dy="2">\1</tspan><tspan dy="-2">\2</tspan>', body)
    body = _identities(body, identity)
    body = re.sub(r"\s*\n\s*", "", body)
    width, height = (72.0 * side for side in figure.get_size_inches())
    frame = Markup('<svg viewBox="0 0 {:g} {:g}" role="img" aria-label="{}">').format(width, height, label)
    return frame + Markup(body) + Markup("</svg>")


def _compact(path: str) -> str:
    """Path data to a hundredth of a point, without blanks that SVG does not need; paths of zero length as dots."""
    data = _DECIMALS.sub("", " ".join(path.split()))
    data = re.sub(r" ?([MLCQz]) ?", r"\1", data)
    return _DOT.sub(r"M\1 \2h0", data)


def _identities(body: str, prefix: str) -> str:
    """Ids that are referred to, renumbered with the prefix; roles as classes; no other ids."""
    numbered = {name: f"{prefix}-{i}" for i, name in enumerate(dict.fromkeys(_REFERENCE.findall(body)))}

    def renamed(found: re.Match[str]) -> str:
        name = found[1]
        if name in ROLES:
            return f' class="{name}"'
        return f' id="{numbered[name]}"' if name in numbered else ""

    body = _IDENTITY.sub(renamed, body)
    for name, new in numbered.items():
        body = body.replace(f'xlink:href="#{name}"', f'href="#{new}"').replace(f"url(#{name})", f"url(#{new})")
    return body
