"""Escapes: nothing that acts on a terminal is left, and JSON and TOML read back as what they were."""

import json
import tomllib

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from wmr_schemas.text import encodable, json_text, markdown, shown, shown_lines, toml_shown

ANY = st.text(max_size=20)
ENCODABLE = st.text(st.characters(exclude_categories=["Cs"]), max_size=20)


@pytest.mark.parametrize(
    ("text", "escaped"),
    [
        ("/pose/größe ▲", "/pose/größe ▲"),
        ("a\x1b[2J", "a\\x1b[2J"),
        ("\x00\x07\t\r\n\x7f", "\\x00\\x07\\t\\r\\n\\x7f"),
        ("\x9b31m\x85", "\\x9b31m\\x85"),
        ("\u202e\u2066\u200f\u2028", "\\u202e\\u2066\\u200f\\u2028"),
        ("\U000e0041", "\\U000e0041"),
        ("\udcff", "\\udcff"),
        ("C:\\logs", "C:\\logs"),
    ],
)
def test_what_is_not_printable_is_escaped(text, escaped):
    assert shown(text) == escaped


@given(ANY)
def test_every_text_becomes_printable(text):
    assert shown(text).isprintable()
    assert shown(shown(text)) == shown(text)
    assert shown_lines(text).replace("\n", "").isprintable()
    assert shown_lines(text).count("\n") == text.count("\n")
    encodable(text).encode()


@given(st.recursive(ANY, lambda inner: st.lists(inner) | st.dictionaries(ANY, inner), max_leaves=5))
def test_json_without_control_codes_reads_back(content):
    text = json_text(content)
    assert text.replace("\n", "").isprintable()
    assert json.loads(text) == content


@given(st.dictionaries(ENCODABLE, ENCODABLE | st.lists(ENCODABLE, max_size=2)))
def test_toml_without_control_codes_reads_back(content):
    text = toml_shown(tomli_w.dumps(content))
    assert text.replace("\n", "").isprintable()
    assert tomllib.loads(text) == content


def test_toml_of_a_lone_surrogate_can_be_written_and_read():
    text = toml_shown(tomli_w.dumps({"topic": "/a\ud800b"}))
    assert tomllib.loads(text) == {"topic": "/a\ufffdb"}


def test_markdown_shows_punctuation_as_it_is():
    assert markdown("a_b _c_ [x](y) <b>\x1b") == "a_b \\_c\\_ \\[x\\](y) \\<b\\>\\\\x1b"
