"""Standard output and error: what their encoding lacks becomes ASCII, and a reader that left ends quietly.

A terminal or pipe may know ASCII or a code page alone. Text is then written with the nearest ASCII: ``±`` as
``+/-``, ``α`` as ``alpha``, ``●`` as ``*``; what has none as an escape, ``\\u4e2d``.
"""

import codecs
import contextlib
import io
import os
import re
import sys
import unicodedata
from collections.abc import Iterator

HANDLER = "wmr-ascii"
ASCII = {
    "●": "*",
    "◐": "%",
    "◌": "o",
    "○": "o",
    "■": "#",
    "█": "#",
    "▒": "=",
    "░": "-",
    "━": "=",
    "╋": "|",
    "│": "|",
    "─": "-",
    "…": "...",
    "–": "-",
    "—": "-",
    "−": "-",
    "±": "+/-",
    "×": "x",
    "·": "-",
    "→": "->",
    "←": "<-",
    "≤": "<=",
    "≥": ">=",
    "≈": "~",
    "∞": "inf",
    "∫": "integral",
    "√": "sqrt",
    "∂": "d",
    "°": "deg",
    "²": "^2",
    "³": "^3",
    "⁻": "^-",
    "½": "1/2",
    "ø": "o",
    "Σ": "sum",
    "≡": "==",
    "∘": "o",
    "‖": "||",
    "⌈": "[",
    "⌉": "]",
    "§": "section ",
    "µ": "u",
}
GREEK = re.compile("GREEK (SMALL|CAPITAL) LETTER ([A-Z]+)")


def prepare_streams() -> None:
    """Let standard output and error write every text in whatever encoding they have."""
    codecs.register_error(HANDLER, replaced)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and stream.errors != HANDLER:
            stream.reconfigure(errors=HANDLER)


def replaced(error: UnicodeError) -> tuple[str, int]:
    """The error handler: ASCII in place of what the encoding lacks."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return "".join(map(ascii_of, error.object[error.start : error.end])), error.end


def ascii_of(character: str) -> str:
    """A character in ASCII: by table, the name of a Greek letter, the letter below its accents, an escape."""
    if character in ASCII:
        return ASCII[character]
    if greek := GREEK.fullmatch(unicodedata.name(character, "")):
        return greek[2].capitalize() if greek[1] == "CAPITAL" else greek[2].lower()
    if unicodedata.combining(character):
        return ""
    plain = unicodedata.normalize("NFKD", character).encode("ascii", "ignore").decode()
    return plain or character.encode("ascii", "backslashreplace").decode()


def writable(text: str) -> str:
    """The text in characters that standard output has, for what click prints: to ASCII it writes UTF-8."""
    encoding = getattr(sys.stdout, "encoding", None) or "utf-8"
    codecs.register_error(HANDLER, replaced)
    return text.encode(encoding, HANDLER).decode(encoding)


class ReaderLeft(Exception):
    """Nobody reads standard output any more. No OSError: click makes an exit code 1 of a broken pipe."""


@contextlib.contextmanager
def reader_watched() -> Iterator[None]:
    """Turn a broken pipe into ReaderLeft."""
    try:
        yield
    except BrokenPipeError:
        raise ReaderLeft from None


def flush() -> None:
    """Write what is held back. Raises BrokenPipeError where nobody reads any more."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(ValueError):
            stream.flush()


def drop_output() -> None:
    """Let the rest of standard output go nowhere, so that Python's own flush at the end finds a reader."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
