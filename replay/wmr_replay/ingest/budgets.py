"""Budgets of reading: what a log may cost, by the bytes that are in the file.

A log is untrusted input. A few bytes can claim, or unfold into, any amount of work: a compressed chunk, a
type made of types, an array of structs without a byte. Reading spends from these budgets. What is beyond them
– a message, a channel, a chunk – is refused with a sentence. Work that only scans bytes in compiled code has
no budget of its own, since the size of the chunks limits it.
"""

import os
from dataclasses import asdict, dataclass
from typing import Any

from wmr_schemas.errors import InvalidSetting

MIB = 1 << 20


@dataclass(frozen=True)
class ReadBudgets:
    """What one log may cost; the reasons are in the fields' comments. Raise one for a log that needs it."""

    most_chunk_bytes: int = 256 * MIB
    """Bytes that a chunk, or a record outside chunks, may hold. Memory: two of them are held at a time.
    Writers make chunks of about a megabyte."""
    free_chunk_bytes: int = 64 * MIB
    """Bytes that any chunk may hold, however few bytes of the file they come from."""
    most_expansion: float = 100.0
    """Bytes that one stored byte may unfold to in a larger chunk. Measurements compress 2 to 20 times."""
    most_record_bytes: int = 16 * MIB
    """Bytes of a record that describes the file (header, metadata, statistics). Usually some kilobytes."""
    most_summary_bytes: int = 256 * MIB
    """Bytes of the summary section. An index of a million chunks has about 150 MB."""
    free_records: int = 500_000
    """Records outside chunks in a log of no size, some microseconds each; messages there count by pieces."""
    records_per_byte: float = 1 / 256
    """Further ones for each byte of the file. A chunk of a megabyte has a few dozen behind it."""
    most_descriptions: int = 1 << 18
    """Records of schemas and channels that are parsed. A file has at most 2 × 65,535 different ones."""
    most_channels: int = 4096
    """Channels of a file. Robots have some hundred."""
    most_schema_bytes: int = 64 * MIB
    """Bytes of all definitions that are kept. Those of a robot have some hundred kilobytes."""
    most_sample_bytes: int = 4 * MIB
    """Bytes of a message that is looked at to find out what a channel holds. Poses and joint states have less
    than ten kilobytes."""
    most_samples_bytes: int = 64 * MIB
    """Bytes of all those messages."""
    most_definition_bytes: int = 128 << 10
    """Bytes of one channel's definition without comment lines. The longest in common packages have 40 kB."""
    free_definition_bytes: int = MIB
    """Bytes of all different definitions that are parsed, some microseconds each. Only those of channels that
    may serve are parsed."""
    most_depth: int = 64
    """Types within types, and arrays within arrays. Common messages have fewer than ten levels."""
    most_fields: int = 1 << 16
    """Fields of one message, elements of arrays of structs and strings included. A row of numbers counts
    once, except in protobuf and JSON. A transform has 12, so 5,000 of them fit."""
    free_fields: int = 250_000
    """Fields that are walked in Python for a log of no size, some microseconds each. One message of each
    layout is walked."""
    fields_per_byte: float = 0.25
    """Further fields for each byte of the log."""
    layout_fields: int = 256
    """What a new layout costs beside its fields: the pass that reads its messages has to be made."""
    free_messages: int = 1 << 15
    """Messages of the channels in use in a log of no size."""
    messages_per_byte: float = 0.5
    """Further messages for each byte of the log. A message's stamps alone take some bytes, compressed."""

    def most_messages(self, size_bytes: int) -> int:
        """Messages of the channels in use that a log of this size may hold."""
        return self.free_messages + int(self.messages_per_byte * size_bytes)

    def most_records(self, size_bytes: int) -> int:
        """Records outside chunks that a file of this size may hold."""
        return self.free_records + int(self.records_per_byte * size_bytes)

    def may_unfold(self, stored_bytes: int, size_bytes: int) -> bool:
        """Whether a chunk of ``stored_bytes`` in the file may hold ``size_bytes``."""
        by_file = max(self.free_chunk_bytes, self.most_expansion * stored_bytes)
        return size_bytes <= min(by_file, self.most_chunk_bytes)


def read_budgets(text: str) -> ReadBudgets:
    """Budgets from ``key=number,key=number``; the others as they are. Raises InvalidSetting."""
    kinds = {name: type(value) for name, value in asdict(ReadBudgets()).items()}
    values: dict[str, Any] = {}
    for entry in filter(None, (piece.strip() for piece in text.split(","))):
        key, _, number = entry.partition("=")
        if key not in kinds:
            raise InvalidSetting(f"{VARIABLE}: no budget {key!r}; there are {', '.join(kinds)}")
        try:
            values[key] = kinds[key](float(number))
        except (ValueError, OverflowError):
            values[key] = -1
        if values[key] < 0:
            raise InvalidSetting(f"{VARIABLE}: {key}: expected a number, found {number!r}")
    return ReadBudgets(**values)


VARIABLE = "WMR_REPLAY_READ_BUDGETS"
"""The environment variable that sets budgets, as in ``most_expansion=1000,most_depth=100``."""
BUDGETS = read_budgets(os.environ.get(VARIABLE, ""))


class OverBudget(ValueError):
    """Something of a log costs more than its budget; the text says what, and how much there was."""


class Allowance:
    """What is left of a log's budgets for definitions and fields; shared by all its channels."""

    def __init__(self, size_bytes: int = 0, budgets: ReadBudgets = BUDGETS) -> None:
        self.budgets = budgets
        self._n_fields = budgets.free_fields + int(budgets.fields_per_byte * size_bytes)
        self._definitions: set[int] = set()
        self._definition_bytes = budgets.free_definition_bytes
        self._n_left, self._in_message = self._n_fields, 0

    def begin_pass(self) -> None:
        """A new pass over the log begins, with all fields."""
        self._n_left = self._n_fields

    def definition(self, text: str) -> None:
        """Account for a definition that is to be parsed. Raises OverBudget."""
        most, n_bytes = self.budgets.most_definition_bytes, len(text)
        if n_bytes > most:
            raise OverBudget(f"its definition has {n_bytes:,} bytes; {most:,} are read at most")
        if hash(text) in self._definitions:
            return
        if n_bytes > self._definition_bytes:
            most = self.budgets.free_definition_bytes
            raise OverBudget(f"the log's definitions have more than {most:,} bytes, which are read at most")
        self._definitions.add(hash(text))
        self._definition_bytes -= n_bytes

    def begin_message(self) -> None:
        """A message is to be walked."""
        self._in_message = 0
        self.spend(1)

    def spend(self, n_fields: int) -> None:
        """Account for fields of the present message. Raises OverBudget."""
        self._in_message += n_fields
        self._n_left -= n_fields
        most = self.budgets.most_fields
        if self._in_message > most:
            raise OverBudget(f"a message has more than {most:,} fields, which are read at most")
        if self._n_left < 0:
            raise OverBudget(
                f"the messages have more layouts than a log of its size may take: {self._n_fields:,} fields"
            )

    @property
    def is_spent(self) -> bool:
        """Whether no more messages can be walked."""
        return self._n_left < 0


def no_account(n_fields: int) -> None:
    """Spend without limit, for messages that come from no log."""
