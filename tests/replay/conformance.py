"""The files of MCAP's conformance suite, written byte by byte from the format's specification.

https://mcap.dev/spec: "Records", "Summary Section". Every combination of the features below, as the suite
has them: ``ch`` chunked, ``mx`` message index, ``chx`` chunk index, ``st`` statistics, ``rsh`` and ``rch``
repeated schemas and channels, ``ax`` attachment index, ``mdx`` metadata index, ``sum`` summary offsets,
``pad`` three bytes more behind the fields of a record, which a reader has to ignore. No library writes them.
"""

import struct
import zlib
from dataclasses import dataclass, field
from itertools import combinations

MAGIC = b"\x89MCAP0\r\n"
PADDING = b"\x01\xff\xff"
DATA = b"\x01\x02\x03"
_IN_SUMMARY = {"chx", "rsh", "rch", "mdx", "st", "ax"}
_OF_MESSAGES = ("st", "rch", "ch", "mx", "chx", "sum", "pad")
_FEATURES = {
    "NoData": ("st", "sum", "pad"),
    "OneMessage": (*_OF_MESSAGES, "rsh"),
    "OneSchemalessMessage": _OF_MESSAGES,
    "TenMessages": (*_OF_MESSAGES, "rsh"),
    "OneAttachment": ("st", "ax", "sum"),
    "OneMetadata": ("st", "mdx", "sum", "pad"),
}
_TEN_LOG_TIMES = (0, 2, 1, 3, 3, 5, 4, 7, 8, 9)
Message = tuple[int, int, int, int, bytes]
"""Channel id, log time, publish time, sequence, data."""


@dataclass
class Variant:
    """One file of the suite: what it holds, which features it has, and what a reader has to find in it."""

    kind: str
    features: frozenset[str]
    messages: list[Message] = field(default_factory=list)
    content: bytes = b""

    @property
    def name(self) -> str:
        """The suite's name of the file, without its ending."""
        return "-".join([self.kind, *sorted(self.features)])

    def __contains__(self, feature: str) -> bool:
        return feature in self.features

    @property
    def has_schema(self) -> bool:
        return self.kind in {"OneMessage", "TenMessages"}


def variants() -> list[Variant]:
    """All files, with their content."""
    found = []
    for kind, features in _FEATURES.items():
        for n in range(len(features) + 1):
            for chosen in combinations(features, n):
                variant = Variant(kind, frozenset(chosen), _messages(kind))
                if _is_possible(variant):
                    variant.content = _content(variant)
                    found.append(variant)
    return found


def _is_possible(variant: Variant) -> bool:
    """Indexes are of chunks; summary offsets point to groups of the summary."""
    if variant.features & {"mx", "chx"} and "ch" not in variant:
        return False
    return "sum" not in variant or bool(variant.features & _IN_SUMMARY)


def _messages(kind: str) -> list[Message]:
    if kind == "TenMessages":
        return [(1, t, t, k, DATA) for k, t in enumerate(_TEN_LOG_TIMES)]
    return [(1, 2, 1, 10, DATA)] if kind.endswith("Message") else []


def record(opcode: int, content: bytes) -> bytes:
    """Opcode, length, content."""
    return struct.pack("<BQ", opcode, len(content)) + content


def text(value: str) -> bytes:
    """A string with its length in front."""
    return struct.pack("<I", len(value)) + value.encode()


def text_map(pairs: dict[str, str]) -> bytes:
    """Pairs of strings with their length in bytes in front."""
    content = b"".join(text(key) + text(value) for key, value in pairs.items())
    return struct.pack("<I", len(content)) + content


def _padded(variant: Variant, opcode: int, content: bytes) -> bytes:
    return record(opcode, content + PADDING * ("pad" in variant))


def _schema() -> bytes:
    return struct.pack("<H", 1) + text("Example") + text("c") + struct.pack("<I", 3) + b"\x04\x05\x06"


def _channel(variant: Variant) -> bytes:
    if not variant.has_schema:
        return struct.pack("<HH", 1, 0) + text("example") + text("text") + text_map({})
    return struct.pack("<HH", 1, 1) + text("example") + text("a") + text_map({"foo": "bar"})


def _content(variant: Variant) -> bytes:
    out = MAGIC + _padded(variant, 0x01, text("") + text(""))
    chunk_index, attachment_index, metadata_index = b"", b"", b""
    if "ch" in variant and variant.messages:
        chunk, chunk_index = _chunk(variant, len(out))
        out += chunk
    elif variant.messages:
        out += _message_section(variant, padded=True)
    if variant.kind == "OneAttachment":
        attachment, attachment_index = _attachment(len(out))
        out += attachment
    if variant.kind == "OneMetadata":
        start = len(out)
        out += _padded(variant, 0x0C, text("myMetadata") + text_map({"foo": "bar"}))
        metadata_index = struct.pack("<QQ", start, len(out) - start) + text("myMetadata")
    out += record(0x0F, struct.pack("<I", zlib.crc32(out)))
    groups = [
        (0x03, _schema(), "rsh" in variant),
        (0x04, _channel(variant), "rch" in variant),
        (0x0B, _statistics(variant), "st" in variant),
        (0x0D, metadata_index, "mdx" in variant),
        (0x0A, attachment_index, "ax" in variant),
        (0x08, chunk_index, "chx" in variant),
    ]
    return out + _summary(variant, len(out), [(opcode, body) for opcode, body, wanted in groups if wanted])


def _message_section(variant: Variant, *, padded: bool) -> bytes:
    """Schema, channel and messages; a message's data go to its record's end, so that nothing may follow."""
    padding = PADDING * (padded and "pad" in variant)
    out = record(0x03, _schema() + padding) if variant.has_schema else b""
    out += record(0x04, _channel(variant) + padding)
    for channel_id, log_ns, publish_ns, sequence, data in variant.messages:
        out += record(0x05, struct.pack("<HIQQ", channel_id, sequence, log_ns, publish_ns) + data)
    return out


def _chunk(variant: Variant, start: int) -> tuple[bytes, bytes]:
    """A chunk with its message index, and the content of its chunk index."""
    records = _message_section(variant, padded=False)
    places, position = [], 0
    while position < len(records):
        opcode, length = struct.unpack_from("<BQ", records, position)
        if opcode == 0x05:
            places.append(position)
        position += 9 + length
    log_times = [message[1] for message in variant.messages]
    head = struct.pack("<QQQI", min(log_times), max(log_times), len(records), zlib.crc32(records)) + text("")
    chunk = record(0x06, head + struct.pack("<Q", len(records)) + records)
    index, offsets = b"", b""
    if "mx" in variant:
        entries = b"".join(struct.pack("<QQ", t, place) for t, place in zip(log_times, places, strict=True))
        index = _padded(variant, 0x07, struct.pack("<HI", 1, len(entries)) + entries)
        offsets = struct.pack("<HQ", 1, start + len(chunk))
    chunk_index = (
        struct.pack("<QQQQI", min(log_times), max(log_times), start, len(chunk), len(offsets)) + offsets
    )
    chunk_index += struct.pack("<Q", len(index)) + text("") + struct.pack("<QQ", len(records), len(records))
    return chunk + index, chunk_index


def _attachment(start: int) -> tuple[bytes, bytes]:
    """An attachment with its checksum, and the content of its index."""
    kind = text("application/octet-stream")
    body = struct.pack("<QQ", 2, 1) + text("myFile") + kind + struct.pack("<Q", len(DATA)) + DATA
    whole = record(0x09, body + struct.pack("<I", zlib.crc32(body)))
    times = struct.pack("<QQQ", 2, 1, len(DATA))
    return whole, struct.pack("<QQ", start, len(whole)) + times + text("myFile") + kind


def _statistics(variant: Variant) -> bytes:
    n = len(variant.messages)
    log_times = [message[1] for message in variant.messages] or [0]
    counts = struct.pack("<HQ", 1, n) if n else b""
    n_others = (variant.kind == "OneAttachment", variant.kind == "OneMetadata", "ch" in variant and n > 0)
    head = struct.pack("<QHI", n, variant.has_schema, n > 0) + struct.pack("<III", *n_others)
    return head + struct.pack("<QQI", min(log_times), max(log_times), len(counts)) + counts


def _summary(variant: Variant, start: int, groups: list[tuple[int, bytes]]) -> bytes:
    """The summary section, the footer and the closing magic."""
    out, offsets = b"", b""
    for opcode, body in groups:
        group = _padded(variant, opcode, body)
        entry = struct.pack("<BQQ", opcode, start + len(out), len(group))
        offsets += _padded(variant, 0x0E, entry)
        out += group
    starts = start if groups else 0, start + len(out) if "sum" in variant else 0
    out += offsets if "sum" in variant else b""
    footer = struct.pack("<BQQQ", 0x02, 20, *starts)
    return out + footer + struct.pack("<I", zlib.crc32(out + footer)) + MAGIC
