r"""Text that comes from a file, made safe to show: control codes are escaped, wherever they would act.

A topic, a joint, a frame, a value of the metadata or a file's name may hold any character. ESC moves a
terminal's cursor and changes its title; C1 codes do the same in one character; bidirectional overrides turn
a line around; NUL and its like are illegal in XML. What is not printable in the sense of
:meth:`str.isprintable` (Unicode categories C and Z, but for the space) is therefore shown as Python would
write it in a literal: ``\x1b``, ``\u202e``. A backslash stays as it is, since it does nothing and paths of
Windows are full of them; the escaped text is for people, not for reading back. JSON and TOML have escapes of
their own, which read back as the same text.
"""

import json
import re
from typing import Any

_BMP = 0xFFFF
MOST_IN_FULL = 1e15
"""Larger numbers are no counts, and longer than a line should hold."""
_MARKDOWN = re.compile(r"([\\`*\[\]<>#|~$&]|(?<![^\W_])_|_(?![^\W_]))")
"""An underscore inside a word means nothing; without brackets there is no link."""


def shown(text: object) -> str:
    """The text in one line: whatever is not printable is escaped, line ends too."""
    plain = str(text)
    return plain if plain.isprintable() else "".join(c if c.isprintable() else _escaped(c) for c in plain)


def shown_lines(text: object) -> str:
    """The text with its lines as they are: whatever else is not printable is escaped."""
    return "\n".join(map(shown, str(text).split("\n")))


def markdown(text: object) -> str:
    """The text as a piece of Markdown that shows it: punctuation that means something is escaped too."""
    return _MARKDOWN.sub(r"\\\1", shown(text))


def json_text(content: Any, *, indent: int | None = 2) -> str:
    """The content as JSON in which no control code stands; it reads back as the same content."""
    return json_shown(json.dumps(content, indent=indent, ensure_ascii=False))


def json_shown(document: str) -> str:
    r"""A JSON document with all that is not printable as ``\uXXXX``, in lines as before."""
    return _lines_with(document, _json_escaped)


def toml_shown(document: str) -> str:
    r"""A TOML document of basic strings with all that is not printable as ``\uXXXX``, in lines as before."""
    return _lines_with(document, _toml_escaped)


def figure(value: float | None, digits: int = 4, sign: str = "") -> str:
    """A number of so many digits, or a dash. What is whole or large is written in full, never as 1.2e+04."""
    if value is None:
        return "–"
    exponent = "e+" in f"{value:.{digits}g}"
    large = abs(value) < MOST_IN_FULL and (float(value).is_integer() or exponent)
    return f"{value:{sign}.0f}" if large else f"{value:{sign}.{digits}g}"


def encodable(text: object) -> str:
    """The text with escapes for what UTF-8 cannot hold: bytes of a file's name that are no UTF-8."""
    return str(text).encode(errors="backslashreplace").decode()


def _lines_with(document: str, escaped: Any) -> str:
    """The document with every character that is not printable escaped, but for its line ends."""
    if document.replace("\n", "").isprintable():
        return document
    return "".join(c if c.isprintable() or c == "\n" else escaped(c) for c in document)


def _escaped(character: str) -> str:
    """The character as in a literal of Python."""
    return character.encode("unicode_escape").decode()


def _json_escaped(character: str) -> str:
    """The character as in a string of JSON; beyond 16 bits as a pair of surrogates."""
    return json.dumps(character)[1:-1]


def _toml_escaped(character: str) -> str:
    """The character as in a basic string of TOML, which has no surrogates: they are replaced."""
    code = ord(character)
    if 0xD800 <= code <= 0xDFFF:
        return "\\ufffd"
    return f"\\u{code:04x}" if code <= _BMP else f"\\U{code:08x}"
