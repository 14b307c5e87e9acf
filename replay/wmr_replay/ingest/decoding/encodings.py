"""Definitions by encoding and schema: the fields of a channel's messages, and how to read them in columns."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Protocol

from wmr_replay.ingest.budgets import Allowance, OverBudget
from wmr_replay.ingest.decoding.binary_program import compile_program
from wmr_replay.ingest.decoding.binary_source import BinarySource
from wmr_replay.ingest.decoding.bindings import Recipe
from wmr_replay.ingest.decoding.cdr import cdr_layout, ros1_layout
from wmr_replay.ingest.decoding.json_source import JsonSource, json_layout
from wmr_replay.ingest.decoding.json_template import compile_template
from wmr_replay.ingest.decoding.layout import Layout, Source, Spend, Undecodable
from wmr_replay.ingest.decoding.ros_definitions import (
    Node,
    UnknownDefinition,
    parse_definition,
    without_comments,
)
from wmr_replay.ingest.mcap.records import Channel, Schema
from wmr_schemas.arrays import F64, I64, U8, Bool


class Program(Protocol):
    """One compiled pass over messages of one layout; whatever departs from it is left alone."""

    def run(
        self, data: U8, starts: I64, lengths: I64, first: int, stamp_ns: I64, raw: F64, used: Bool
    ) -> int:
        """Fill in the messages that fit and are not ``used`` yet, message k in row ``first`` + k; how many
        they were.
        """


class Definition(Protocol):
    """What the messages of a channel are made of."""

    allowance: Allowance
    """What walking messages may cost."""

    @property
    def spelling_varies(self) -> bool:
        """Whether messages of one layout may differ in bytes that are no values, such as blanks."""

    def has(self, path: str) -> bool:
        """Whether there is a field at a dotted path, set or not."""

    def layout(self, message: bytes) -> Layout:
        """The layout of one message. Raises Undecodable."""

    def source(self, data: U8, starts: I64, lengths: I64) -> Source:
        """Messages of a block, ready to be read in columns."""

    def program(self, layout: Layout, recipe: Recipe) -> Program | None:
        """The quick way to read messages of that layout, where there is one."""


class RosDefinition:
    """ROS messages: ROS 2's CDR or ROS 1's wire form."""

    spelling_varies = False

    def __init__(
        self, node: Node, walk: Callable[[Node, bytes, Spend], Layout], allowance: Allowance
    ) -> None:
        self.node, self.walk, self.allowance = node, walk, allowance

    def has(self, path: str) -> bool:
        """Whether the definition has such a field."""
        return self.node.has(path)

    def layout(self, message: bytes) -> Layout:
        """Walk one message. Raises Undecodable."""
        with accounted(self.allowance) as spend:
            return self.walk(self.node, message, spend)

    def source(self, data: U8, starts: I64, lengths: I64) -> Source:
        """The messages as columns, by byte offset."""
        return BinarySource(data, starts, lengths)

    def program(self, layout: Layout, recipe: Recipe) -> Program | None:
        """The pass that compares words and gathers numbers, where it can express the layout."""
        return compile_program(layout, recipe)


class JsonDefinition:
    """JSON messages: what the first of them holds."""

    spelling_varies = True

    def __init__(self, samples: Sequence[bytes], allowance: Allowance) -> None:
        self.allowance = allowance
        self.fields: set[str] = set()
        for sample in samples:
            with suppress(Undecodable):
                layout = self.layout(sample)
                self.fields |= layout.leaves.keys() | layout.texts.keys() | layout.counts.keys()
        if not self.fields:
            raise UnknownDefinition("its first messages are not JSON objects")

    def has(self, path: str) -> bool:
        """Whether one of the first messages has such a field."""
        return path in self.fields

    def layout(self, message: bytes) -> Layout:
        """Decode one message. Raises Undecodable."""
        with accounted(self.allowance) as spend:
            return json_layout(message, spend)

    def source(self, data: U8, starts: I64, lengths: I64) -> Source:
        """The messages as columns, by the ordinal of a scalar value."""
        return JsonSource(data, starts, lengths)

    def program(self, layout: Layout, recipe: Recipe) -> Program | None:
        """The pass that compares text and reads numbers in place."""
        return compile_template(layout, recipe)


@contextmanager
def accounted(allowance: Allowance) -> Iterator[Spend]:
    """Walk one message at the expense of the log's allowance. Raises Undecodable where it is used up."""
    try:
        allowance.begin_message()
        yield allowance.spend
    except OverBudget as error:
        raise Undecodable(str(error)) from None


_ROS: dict[str, Callable[[Node, bytes, Spend], Layout]] = {"cdr": cdr_layout, "ros1": ros1_layout}


def define(
    channel: Channel, schema: Schema | None, samples: Sequence[bytes], allowance: Allowance | None = None
) -> Definition:
    """The definition of a channel's messages, read at the expense of ``allowance``.

    Raises UnknownDefinition with the reason.
    """
    allowance = allowance or Allowance()
    encoding = channel.message_encoding
    if encoding == "json":
        return JsonDefinition(samples, allowance)
    if encoding not in {"protobuf", *_ROS}:
        raise UnknownDefinition(f"message encoding {encoding!r} is not read")
    if schema is None:
        raise UnknownDefinition("it has no schema")
    is_text = encoding in _ROS
    text = schema.data.decode(errors="replace") if is_text else schema.data.decode("latin-1")
    text = without_comments(text) if is_text else text
    try:
        allowance.definition(text)
    except OverBudget as error:
        raise UnknownDefinition(str(error)) from None
    if not is_text:
        from wmr_replay.ingest.decoding.protobuf_definition import ProtobufDefinition  # noqa: PLC0415 – slow

        return ProtobufDefinition(schema.name, schema.data, allowance)
    return RosDefinition(parse_definition(schema.name, schema.encoding, text), _ROS[encoding], allowance)
