"""JSON however it is spelled: compiled template and msgspec give the same columns; oracle: Python's json."""

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import Writer

from wmr_replay.ingest import open_log
from wmr_replay.ingest.decoding.encodings import JsonDefinition
from wmr_replay.ingest.decoding.json_source import flat_message, repeats_a_key
from wmr_replay.ingest.decoding.json_template import value_spans
from wmr_replay.ingest.decoding.layout import Undecodable
from wmr_schemas.mapping_file import LogMapping

T0 = 1_700_000_000
HEAD = '{{"timestamp": {{"sec": {sec}, "nsec": {nsec}}}, "frame_id": "map", "pose": '
POSE = '{{"position": {{"x": {x}, "y": 2}}, "orientation": {{"x": 0, "y": 0, "z": 0, "w": 1}}}}}}'


def pose_text(x="1.5", sec=T0, nsec=0):
    return (HEAD + POSE).format(x=x, sec=sec, nsec=nsec)


def read(path, texts):
    """Stamps and x of a log of these messages, and its reader."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("foxglove.PoseInFrame", "jsonschema", b"{}")
        channel = writer.register_channel("/pose", "json", schema)
        for k, text in enumerate(texts):
            data = text if isinstance(text, bytes) else text.encode()
            writer.add_message(channel, k, data, k)
        writer.finish()
    reader = open_log(path, LogMapping(clock="header"))
    batches = [batch.pose for batch in reader.batches()]
    t_ns, x = np.concatenate([b.t_ns for b in batches]), np.concatenate([b.values[0] for b in batches])
    return t_ns, x, reader


SPELLINGS = (
    "3 3.0 30e-1 0.3E+1 -0 -0.0 1e-400 5e-324 2.2250738585072011e-308 9007199254740993 9007199254740993.0 "
    "0.1234567890123456789012345678901 1e400 -1e400 NaN Infinity -Infinity 123456789012345678901234567890 "
    "18446744073709551616 1.7976931348623157e308"
).split()


@pytest.mark.parametrize("x", [*SPELLINGS, "7" * 400])
def test_every_spelling_of_a_number_gives_the_nearest_double(tmp_path, x):
    alike = pose_text("0.25")
    _, found, reader = read(tmp_path / "a.mcap", [alike, pose_text(x), alike])
    expected = math.inf if len(x) == 400 else float(json.loads(x))
    np.testing.assert_array_equal(found, [0.25, expected, 0.25])
    assert not reader.losses.any()


@pytest.mark.parametrize("x", ["null", "true", "false"])
def test_what_is_no_number_gives_nan(tmp_path, x):
    _, found, reader = read(tmp_path / "a.mcap", [pose_text(), pose_text(x)])
    np.testing.assert_array_equal(found, [1.5, np.nan])
    assert not reader.losses.any()


BROKEN = [
    "",
    "{",
    "[1, 2]",
    "7",
    pose_text("01"),
    pose_text("1."),
    pose_text("+1"),
    pose_text()[:-1],
    pose_text() + "}",
    pose_text().encode().replace(b"map", b"m\xff"),
    "[" * 100_000,
    '{"a": ' * 5_000 + "1" + "}" * 5_000,
    pose_text('"1.5"'),
]


def test_messages_that_are_no_pose_are_counted_and_do_not_stop_the_others(tmp_path):
    texts = [pose_text(), *(text for broken in BROKEN for text in (broken, pose_text("2.5")))]
    _, found, reader = read(tmp_path / "a.mcap", texts)
    assert reader.losses.n_undecodable == len(BROKEN)
    assert sorted(found.tolist()) == [1.5] + [2.5] * len(BROKEN)


def test_of_a_repeated_key_the_last_value_counts(tmp_path):
    first = pose_text("1")
    twice = first.replace('"x": 1,', '"x": 5, "x": 6,')
    empty = first.replace(
        '"position": {', '"position": {}, "position": {"y": 9, "x": 7, "y": 8}, "position": {'
    )
    _, found, reader = read(tmp_path / "a.mcap", [twice, first, twice, empty, twice])
    assert found.tolist() == [6.0, 1.0, 6.0, 1.0, 6.0]
    assert not reader.losses.any()
    assert repeats_a_key(twice.encode())
    assert not repeats_a_key(first.encode())


@pytest.mark.parametrize(
    ("sec", "stamp_s"), [(str(T0), T0), (f"{T0}.0", T0), (f"{T0}.9", T0), ("null", 0), ("1" + "0" * 30, 0)]
)
def test_stamps_are_whole_numbers_of_64_bits_or_none(tmp_path, sec, stamp_s):
    t_ns, _, _ = read(tmp_path / "a.mcap", [pose_text(), pose_text(sec=sec, nsec=7)])
    assert t_ns.tolist() == [T0 * 10**9, stamp_s * 10**9 + 7]


finite = st.floats(allow_nan=False, allow_infinity=False)
orders = st.permutations(["timestamp", "frame_id", "pose", "note", "list"])
notes = st.one_of(st.text(), st.none(), st.booleans(), st.integers(), st.lists(finite, max_size=3))


@st.composite
def spelled(draw):
    """A pose message with its keys in any order, any blanks, and fields that nobody needs."""
    x = draw(finite)
    fields = json.loads(pose_text()) | {"note": draw(notes), "list": draw(st.lists(notes, max_size=3))}
    fields["pose"]["position"]["x"] = x
    fields = {key: fields[key] for key in draw(orders)}
    text = json.dumps(fields, indent=draw(st.sampled_from([None, 1])), ensure_ascii=draw(st.booleans()))
    return x, text.encode("utf-8", errors="replace")


@settings(max_examples=60, deadline=None)
@given(messages=st.lists(spelled(), min_size=1, max_size=20))
def test_with_and_without_templates_any_spelling_gives_what_json_says(tmp_path_factory, messages):
    path = tmp_path_factory.mktemp("j") / "a.mcap"
    _, x, reader = read(path, [text for _, text in messages])
    assert x.tolist() == [value for value, _ in messages]
    assert not reader.losses.any()
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(JsonDefinition, "program", lambda *_: None)
        _, again, _ = read(path, [text for _, text in messages])
    assert np.array_equal(x, again)


def test_a_new_spelling_in_the_middle_of_a_log_gets_its_own_template(tmp_path):
    old = [pose_text(str(k)) for k in range(1000)]
    new = [text.replace(", ", ",") for text in old]
    _, x, reader = read(tmp_path / "a.mcap", [*old, *new])
    assert x.tolist() == [*range(1000), *range(1000)]
    assert not reader.losses.any()


scalars = st.one_of(st.none(), st.booleans(), st.integers(), finite, st.text())
values = st.recursive(
    scalars, lambda inner: st.one_of(st.lists(inner), st.dictionaries(st.text(), inner)), max_leaves=12
)


@given(content=st.dictionaries(st.text(), values), indent=st.sampled_from([None, 0, 2]))
def test_the_spans_of_a_text_are_its_scalar_values_in_order(content, indent):
    message = json.dumps(content, indent=indent).encode()
    spelled = [message[a:b].decode() for a, b in value_spans(message)]
    flat = flat_message(message)
    assert spelled == [json.dumps(v)[1:-1] if isinstance(v, str) else json.dumps(v) for v in flat.values]


@pytest.mark.parametrize("message", [b"[1]", b"1", b'"a"', b"", b"\xff"])
def test_what_is_no_object_is_undecodable(message):
    with pytest.raises(Undecodable):
        flat_message(message)
