"""The definition of protobuf messages; apart, since protobuf is slow to import."""

from wmr_replay.ingest.budgets import Allowance
from wmr_replay.ingest.decoding.binary_program import compile_program
from wmr_replay.ingest.decoding.binary_source import BinarySource
from wmr_replay.ingest.decoding.bindings import Recipe
from wmr_replay.ingest.decoding.encodings import Program, accounted
from wmr_replay.ingest.decoding.layout import Layout, Source
from wmr_replay.ingest.decoding.protobuf import has_field, parse_descriptor, protobuf_layout
from wmr_schemas.arrays import I64, U8


class ProtobufDefinition:
    """Protobuf messages, by their descriptor."""

    spelling_varies = False

    def __init__(self, name: str, descriptors: bytes, allowance: Allowance) -> None:
        """``descriptors``: a serialised FileDescriptorSet that holds ``name``. Raises UnknownDefinition."""
        self.descriptor, self.allowance = parse_descriptor(name, descriptors), allowance

    def has(self, path: str) -> bool:
        """Whether the descriptor has such a field."""
        return has_field(self.descriptor, path)

    def layout(self, message: bytes) -> Layout:
        """Walk one message. Raises Undecodable."""
        with accounted(self.allowance) as spend:
            return protobuf_layout(self.descriptor, message, spend)

    def source(self, data: U8, starts: I64, lengths: I64) -> Source:
        """The messages as columns, by byte offset."""
        return BinarySource(data, starts, lengths)

    def program(self, layout: Layout, recipe: Recipe) -> Program | None:
        """The pass that compares words and gathers numbers, where it can express the layout."""
        return compile_program(layout, recipe)
