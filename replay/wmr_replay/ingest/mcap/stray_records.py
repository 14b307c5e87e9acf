"""Records of a type that may not stand where they are, or that this version does not know.

A message whose type changed by a flipped bit is such a record: it is not counted as damage by anything else.
Types: the MCAP specification, section "Records"; 0x10 to 0x7F are reserved, those from 0x80 on are private.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from wmr_replay.ingest.mcap.records import Opcode
from wmr_schemas.arrays import I64, U8

_FIRST_RESERVED, _FIRST_PRIVATE = 0x10, 0x80
_IN_CHUNKS = {Opcode.SCHEMA, Opcode.CHANNEL}
_IN_SUMMARY = {Opcode.CHUNK_INDEX, Opcode.ATTACHMENT_INDEX, Opcode.STATISTICS, Opcode.METADATA_INDEX,
               Opcode.SUMMARY_OFFSET}  # fmt: skip


@dataclass
class StrayRecords:
    """Numbers of such records by type."""

    misplaced: Counter[int] = field(default_factory=Counter)
    unknown: Counter[int] = field(default_factory=Counter)

    def add(self, other: "StrayRecords") -> None:
        """Add the numbers of another instance."""
        self.misplaced.update(other.misplaced)
        self.unknown.update(other.unknown)

    def meet(self, opcode: int, *, in_order: bool) -> None:
        """Count a record that is no schema, channel or message, unless it is known and ``in_order``."""
        if opcode >= _FIRST_RESERVED:
            self.unknown[opcode] += 1
        elif not in_order:
            self.misplaced[opcode] += 1

    def meet_in_chunk(self, data: U8, starts: I64) -> None:
        """Count the records of a chunk that start at ``starts``; too short messages are among them."""
        for opcode, n in enumerate(np.bincount(data[starts]).tolist()):
            if n and opcode not in _IN_CHUNKS:
                (self.unknown if opcode >= _FIRST_RESERVED else self.misplaced)[opcode] += n

    def losses(self) -> Iterator[str]:
        """What was lost, in words."""
        for opcode, n in sorted(self.misplaced.items()):
            if opcode == Opcode.MESSAGE:
                yield f"{n} message records are too short to be any"
            else:
                yield f"{n} records of type {opcode:#04x} stand where none may, and are left out"

    def remarks(self) -> Iterator[str]:
        """What was passed over, in words."""
        for opcode, n in sorted(self.unknown.items()):
            kind = (
                "the private type" if opcode >= _FIRST_PRIVATE else "a type that this version does not know,"
            )
            yield f"{n} records of {kind} {opcode:#04x} are passed over"


def is_in_order(opcode: int, *, first: bool, in_summary: bool, behind_chunk: bool) -> bool:
    """Whether a record outside chunks may stand there: as the file's first, in its summary, behind a chunk or
    a chunk's index.
    """
    if opcode == Opcode.HEADER:
        return first
    if opcode == Opcode.MESSAGE_INDEX:
        return behind_chunk and not in_summary
    if opcode in {Opcode.CHUNK, Opcode.DATA_END}:
        return not in_summary
    return in_summary or opcode not in _IN_SUMMARY
