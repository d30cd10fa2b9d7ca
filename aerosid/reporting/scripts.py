"""The scripts inside a page, and the policy that permits only these."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from markupsafe import Markup

from aerosid.errors import UsageError
from aerosid.reporting.figures.interactive import figures_json
from aerosid.reporting.figures.numbered import Figure

_OWN = Path(__file__).parent / "templates" / "interactive.js"


@dataclass(frozen=True)
class Script:
    """A script, or data for one."""

    text: str
    data: str = ""
    """The id of a data block; empty for executed scripts."""

    @property
    def element(self) -> Markup:
        """The element in the page."""
        opening = f'<script type="application/json" id="{self.data}">' if self.data else "<script>"
        return Markup(f"{opening}{self.text}</script>")  # safe: plotly's, ours, or JSON without `<`

    @property
    def checksum(self) -> str:
        """SHA-256 in the notation of a Content-Security-Policy."""
        return base64.b64encode(hashlib.sha256(self.text.encode("utf-8")).digest()).decode("ascii")


def page_scripts(figures: Sequence[Figure]) -> tuple[Script, ...]:
    """The figures' data, plotly, and the script that inserts them into the page; empty where there is no figure."""
    if not figures:
        return ()
    return (
        Script(figures_json(figures), data="figure-data"),
        Script(_plotly()),
        Script(_OWN.read_text(encoding="utf-8")),
    )


def content_policy(scripts: Sequence[Script]) -> str:
    """Permissions of the page: its style and exactly these scripts; plotly saves pictures through blobs."""
    sums = " ".join(f"'sha256-{script.checksum}'" for script in scripts if not script.data)
    allowed = f"; script-src {sums}; img-src data: blob:" if sums else ""
    return f"default-src 'none'; style-src 'unsafe-inline'{allowed}"


def _plotly() -> str:
    """plotly.js from its Python package; read as text, since importing that package would take longer."""
    spec = find_spec("plotly")
    if spec is None or spec.origin is None:
        raise UsageError(
            "plotly is not installed; run again with --static, or reinstall aerosid with its dependencies."
        )
    return (Path(spec.origin).parent / "package_data" / "plotly.min.js").read_text(encoding="utf-8")
