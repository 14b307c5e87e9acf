"""The JavaScript that draws a page's figures: Vega, Vega-Lite and Vega-Embed in one piece.

It comes out of vl-convert (extra ``report``), which has it inside and needs no network.

Packing the piece takes some seconds; it is kept in the cache directory, below the library's version.
"""

import contextlib
import hashlib
from functools import cache
from importlib.metadata import version
from pathlib import Path

from wmr_schemas.compiled.state import base_directory
from wmr_schemas.errors import MissingExtra
from wmr_schemas.files import whole_file

VEGA_LITE = "6.1"
"""The version of Vega-Lite in which the figures are written."""
ENTRY = "window.vegaEmbed = vegaEmbed;"
"""All that a page uses."""
SCHEMA = "https://vega.github.io/schema/vega-lite/v6.json"


def check_extra() -> None:
    """Raises MissingExtra where the extra is not installed."""
    try:
        import vl_convert  # noqa: F401, PLC0415 – an extra
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "vl_convert":
            raise
        raise MissingExtra("report", "a report", "vl_convert") from None


@cache
def figure_script() -> str:
    """The code as a page holds it. Raises MissingExtra."""
    check_extra()
    kept = kept_file()
    with contextlib.suppress(OSError, UnicodeDecodeError):
        return kept.read_text(encoding="utf-8")
    code = packed()
    with contextlib.suppress(OSError):
        kept.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(kept) as part:
            part.write_text(code, encoding="utf-8")
    return code


def kept_file() -> Path:
    """Where the code is kept: the name holds all that it depends on."""
    text = f"{version('vl-convert-python')} {VEGA_LITE} {ENTRY}"
    return base_directory() / f"report-{hashlib.sha256(text.encode()).hexdigest()[:16]}.js"


def packed() -> str:
    """The code, packed now; no end of a script element stands in it."""
    import vl_convert  # noqa: PLC0415 – an extra

    code = str(vl_convert.javascript_bundle(ENTRY, vl_version=VEGA_LITE))
    return code.replace("</script", "<\\/script").replace("<!--", "<\\!--")
