"""A page loads nothing from another host: scripts, styles, fonts and pictures are the site's own."""

import re
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx
from sphinx.util import logging

LOADED = re.compile(
    r"<(?:script|img|iframe|source|video)\b[^>]*?\ssrc=\"((?:https?:)?//[^\"]+)"
    r"|<link\b(?=[^>]*rel=\"(?:stylesheet|preload|icon|shortcut icon)\")[^>]*?\shref=\"((?:https?:)?//[^\"]+)"
    r"|(?:url\(|@import )[\"']?((?:https?:)?//[^\"')]+)"
)


def loaded_from_elsewhere(text: str) -> list[str]:
    """The addresses of another host that a page or a style sheet loads as it opens; links do not count."""
    return [next(filter(None, found)) for found in LOADED.findall(text)]


def check(app: Sphinx, exception: Exception | None) -> None:
    """Warn of each; warnings are errors."""
    if exception or app.builder.format != "html":
        return
    for path in sorted(Path(app.outdir).rglob("*")):
        if path.suffix in {".html", ".css"}:
            for address in loaded_from_elsewhere(path.read_text(encoding="utf-8")):
                logging.getLogger(__name__).warning("%s loads %s", path.name, address)


def setup(app: Sphinx) -> dict[str, Any]:
    """Sphinx's entry point."""
    app.connect("build-finished", check)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
