"""A channel's encoding and schema to a definition: what the messages are made of, and how to read them in columns."""

from typing import Protocol

from wmr_replay.ingest.binary import BinarySource
from wmr_replay.ingest.cdr import cdr_layout
from wmr_replay.ingest.definitions import Node, UnknownDefinition, parse_definition
from wmr_replay.ingest.layout import Layout, Source
from wmr_replay.ingest.records import Channel, Schema
from wmr_schemas.arrays import I64, U8


class Definition(Protocol):
    """What the messages of a channel are made of."""

    def has(self, path: str) -> bool:
        """Whether there is a field at a dotted path, set or not."""

    def layout(self, message: bytes) -> Layout:
        """The layout of one message. Raises Undecodable."""

    def source(self, data: U8, starts: I64, lengths: I64) -> Source:
        """Messages of a block, ready to be read in columns."""


class CdrDefinition:
    """ROS 2 messages in CDR."""

    def __init__(self, node: Node) -> None:
        self.node = node

    def has(self, path: str) -> bool:
        """Whether the definition has such a field."""
        return self.node.has(path)

    def layout(self, message: bytes) -> Layout:
        """Walk one message."""
        return cdr_layout(self.node, message)

    def source(self, data: U8, starts: I64, lengths: I64) -> Source:
        """Columns by byte offset."""
        return BinarySource(data, starts, lengths)


def define(channel: Channel, schema: Schema | None, samples: list[bytes]) -> Definition:
    """The definition of a channel's messages. Raises UnknownDefinition with the reason."""
    encoding = channel.message_encoding
    if encoding == "cdr":
        if schema is None:
            raise UnknownDefinition("it has no schema")
        return CdrDefinition(parse_definition(schema.name, schema.encoding, schema.data.decode(errors="replace")))
    raise UnknownDefinition(f"message encoding {encoding!r} is not read")
