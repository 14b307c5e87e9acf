"""Messages as MCAP message records in one buffer: joined from pieces, or framed where they already lie."""

from collections.abc import Sequence

import numpy as np

from wmr_replay.ingest.mcap.chunks import NO_BYTES
from wmr_replay.ingest.mcap.records import Opcode
from wmr_replay.ingest.mcap.walk import HEAD_BYTES, MESSAGE_HEAD_BYTES
from wmr_schemas.arrays import I64, U8

MESSAGE_HEAD = np.dtype([
    ("opcode", "u1"), ("length", "<u8"), ("channel", "<u2"), ("sequence", "<u4"), ("log_ns", "<i8"),
    ("publish_ns", "<i8"),
])  # fmt: skip
"""Head of a message record, up to the message's data."""
FILLER_HEAD = np.dtype([("opcode", "u1"), ("length", "<u8")])
_FILLER = 0x80
"""The first opcode that the specification leaves to private records, which every reader skips."""
ROOM_BYTES = HEAD_BYTES + MESSAGE_HEAD.itemsize
"""What :func:`framed` needs in front of each message: the heads of a filler and of a message."""


def message_heads(channel: I64, log_ns: I64, length: I64) -> np.ndarray[tuple[int], np.dtype[np.void]]:
    """Heads (n,) of message records: channel ids, times in ns, lengths of the messages in bytes.

    Bags hold one time for each message. It serves as log time and as publish time, as in converted files.
    """
    heads = np.zeros(len(length), MESSAGE_HEAD)
    heads["opcode"], heads["length"] = int(Opcode.MESSAGE), length + MESSAGE_HEAD_BYTES
    heads["channel"], heads["log_ns"], heads["publish_ns"] = channel, log_ns, log_ns
    return heads


def joined(channel: I64, log_ns: I64, messages: Sequence[bytes]) -> U8:
    """The records of messages that are separate pieces of memory."""
    length = np.fromiter(map(len, messages), np.int64, len(messages))
    pieces = [b""] * (2 * len(messages))
    pieces[::2] = message_heads(channel, log_ns, length).view(f"V{MESSAGE_HEAD.itemsize}").tolist()
    pieces[1::2] = messages
    return np.frombuffer(b"".join(pieces), np.uint8)


def framed(data: U8, channel: I64, log_ns: I64, start: I64, length: I64) -> U8:
    """The records of messages that lie in a writable buffer ``data``, in order, at ``start`` with ``length``
    (n,).

    In front of each message, ROOM_BYTES at least are overwritten: a filler record over what lies between two
    messages, then the message's head. What follows the last message is left out.
    """
    if not len(start):
        return NO_BYTES
    stop = start + length
    gap_start = np.concatenate(([0], stop[:-1]))
    head_start = start - MESSAGE_HEAD.itemsize
    fillers = np.zeros(len(start), FILLER_HEAD)
    fillers["opcode"], fillers["length"] = _FILLER, head_start - gap_start - FILLER_HEAD.itemsize
    _put(data, gap_start, fillers.view(np.uint8).reshape(len(start), -1))
    heads = message_heads(channel, log_ns, length)
    _put(data, head_start, heads.view(np.uint8).reshape(len(start), -1))
    records: U8 = data[: int(stop[-1])]
    return records


def _put(data: U8, start: I64, rows: U8) -> None:
    """Write each row of bytes (n, k) at its place."""
    data[start[:, None] + np.arange(rows.shape[1])] = rows
