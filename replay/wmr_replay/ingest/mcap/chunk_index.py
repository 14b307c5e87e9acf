"""The chunks of a file's index in columns: a hundred thousand of them take some hundredths of a second.

Each chunk index record names its chunk's place, times and sizes, and where the message index of each channel
begins, whose length tells the number of messages. A :class:`Span` is made of a chunk when it is asked for.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self, overload

import numpy as np

from wmr_replay.ingest.mcap.chunks import Span
from wmr_replay.ingest.mcap.records import HEAD, ChunkHead, Malformed
from wmr_schemas.arrays import I64, U8

U64 = np.ndarray[tuple[int, ...], np.dtype[np.uint64]]
_MAP_SIZE_AT, _MAP_AT, _PLACE_BYTES = 32, 36, 10
"""In a chunk index record: times, place and length of the chunk; then a map of channels to places."""
_FIXED_HEAD_BYTES = 40
"""A chunk's head without the name of its compression."""
_INDEX_HEAD_BYTES, _INDEX_ENTRY_BYTES = HEAD.size + 6, 16
MOST_ENTRIES = 1 << 23
"""Entries of all maps, some dozen bytes of memory each: of 100,000 chunks with 80 channels."""
_SHORT = 8
_MOST_CHANNELS = _AT_ONCE = 1 << 16


@dataclass(frozen=True, eq=False)
class ChunkIndex(Sequence[Span]):
    """n chunks as spans, in columns (n,).

    A chunk whose data start where it does (``data_offset`` = ``offset``) is one of a bag, whose head is read
    with it and whose ``uncompressed`` size is 0. ``names`` are the compressions, ``compression`` (n,) which
    of them. Messages: the ``k``-th chunk has ``n[first[k]:first[k + 1]]`` of the channels
    ``ids[first[k]:first[k + 1]]``.
    """

    offset: I64
    data_offset: I64
    stored: I64
    uncompressed: U64
    start_ns: U64
    end_ns: U64
    file_index: I64
    compression: I64
    names: tuple[str, ...]
    first: I64
    ids: I64
    n: I64

    def __len__(self) -> int:
        return len(self.offset)

    @overload
    def __getitem__(self, k: int) -> Span: ...
    @overload
    def __getitem__(self, k: slice) -> list[Span]: ...
    def __getitem__(self, k: int | slice) -> Span | list[Span]:
        if isinstance(k, slice):
            return [self._span(i) for i in range(*k.indices(len(self)))]
        return self._span(range(len(self))[k])

    def _span(self, k: int) -> Span:
        """The k-th chunk as a span."""
        offset, data_offset, stored = int(self.offset[k]), int(self.data_offset[k]), int(self.stored[k])
        times_ns = int(self.start_ns[k]), int(self.end_ns[k])
        name, own = self.names[self.compression[k]], slice(*self.first[k : k + 2].tolist())
        counts = dict(zip(self.ids[own].tolist(), self.n[own].tolist(), strict=True))
        file_index = int(self.file_index[k])
        if data_offset == offset:
            return Span(offset, offset, stored, counts=counts, times_ns=times_ns, file_index=file_index)
        head_bytes = data_offset - offset - HEAD.size
        return Span(
            offset,
            data_offset,
            stored,
            ChunkHead(*times_ns, int(self.uncompressed[k]), 0, name, stored, head_bytes),
            counts=counts,
            times_ns=times_ns,
            file_index=file_index,
            by_index=True,
        )

    @property
    def ordinal(self) -> I64:
        """The chunk (entries,) of each entry of ``ids`` and ``n``."""
        return np.repeat(np.arange(len(self)), np.diff(self.first))

    def take(self, rows: I64) -> Self:
        """Some of the chunks, in that order."""
        sizes = np.diff(self.first)[rows]
        first = np.concatenate([np.zeros(1, np.int64), np.cumsum(sizes)])
        entries = np.repeat(self.first[rows] - first[:-1], sizes) + np.arange(first[-1])
        return replace(
            self,
            **{name: getattr(self, name)[rows] for name in _BY_CHUNK},
            first=first,
            ids=self.ids[entries],
            n=self.n[entries],
        )

    def moved(self, file_index: int, ids: I64) -> Self:
        """The same chunks as those of that file; ``ids`` (65536,) maps its channel ids."""
        return replace(self, file_index=np.full(len(self), file_index, np.int64), ids=ids[self.ids])


_BY_CHUNK = (
    "offset", "data_offset", "stored", "uncompressed", "start_ns", "end_ns", "file_index", "compression",
)  # fmt: skip


def joined(parts: Sequence[ChunkIndex]) -> ChunkIndex:
    """The chunks of several files, one file after another."""
    names = tuple(dict.fromkeys(name for part in parts for name in part.names))
    codes = [np.array([names.index(name) for name in part.names], np.int64) for part in parts]
    recoded = [
        replace(part, compression=code[part.compression]) for part, code in zip(parts, codes, strict=True)
    ]
    columns = {name: np.concatenate([getattr(p, name) for p in recoded]) for name in (*_BY_CHUNK, "ids", "n")}
    sizes = np.concatenate([np.diff(part.first) for part in parts])
    first = np.concatenate([np.zeros(1, np.int64), np.cumsum(sizes)])
    return ChunkIndex(**columns, names=names, first=first)


def chunk_index(summary: bytes, starts: I64, lengths: I64, size_bytes: int) -> ChunkIndex:
    """The chunks by the index records whose contents start at ``starts`` (n,) of the summary, by offset.

    Raises Malformed where a record does not describe a chunk that can stand in a file of ``size_bytes``.
    """
    data, stops = np.frombuffer(summary, np.uint8), starts + lengths
    demand((lengths >= _MAP_AT).all(), "a chunk index that is too short")
    start_ns, end_ns, place, length = (numbers_at(data, starts + 8 * k, 8) for k in range(4))
    map_bytes = numbers_at(data, starts + _MAP_SIZE_AT, 4).astype(np.int64)
    after = starts + _MAP_AT + map_bytes
    demand(not (map_bytes % _PLACE_BYTES).any() and (after + 12 <= stops).all(), "its map of places")
    name_bytes = numbers_at(data, after + 8, 4).astype(np.int64)
    tail = after + 12 + name_bytes
    demand((tail + 16 <= stops).all(), "the name of its compression")
    index, stored, uncompressed = (numbers_at(data, at, 8) for at in (after, tail, tail + 8))
    limit = np.uint64(size_bytes)
    demand((np.stack([place, length, index, stored]) <= limit).all(), "places beyond the file's end")
    offset, whole, behind, packed = (column.astype(np.int64) for column in (place, length, index, stored))
    head_bytes = _FIXED_HEAD_BYTES + name_bytes
    demand((whole == HEAD.size + head_bytes + packed).all(), "a length that is not its chunk's")
    stop = offset + whole + behind
    demand((stop <= size_bytes).all(), "a chunk beyond the file's end")
    names, compression = _names(summary, after + 12, name_bytes)
    n_entries = map_bytes // _PLACE_BYTES
    demand(n_entries.sum() <= MOST_ENTRIES, f"more than {MOST_ENTRIES:,} entries")
    demand(n_entries.max(initial=0) <= _MOST_CHANNELS, "more entries than there are channels")
    ids, n = _counts(data, starts + _MAP_AT, n_entries, stop, size_bytes)
    found = ChunkIndex(
        offset=offset,
        data_offset=offset + HEAD.size + head_bytes,
        stored=packed,
        uncompressed=uncompressed,
        start_ns=start_ns,
        end_ns=end_ns,
        file_index=np.zeros(len(starts), np.int64),
        compression=compression,
        names=names,
        first=np.concatenate([np.zeros(1, np.int64), np.cumsum(n_entries)]),
        ids=ids,
        n=n,
    )
    return found if (np.diff(offset) > 0).all() else found.take(np.argsort(offset, kind="stable"))


def demand(holds: np.bool_ | bool, what: str) -> None:
    """Raises Malformed unless it holds."""
    if not holds:
        raise Malformed(f"the chunk index: {what}")


def numbers_at(data: U8, at: I64, n_bytes: int) -> U64:
    """Little-endian numbers (n,) of so many bytes at these places."""
    numbers: U64 = np.empty(len(at), np.uint64)
    for start in range(0, len(at), _AT_ONCE):
        some = slice(start, start + _AT_ONCE)
        pieces = data[at[some, None] + np.arange(n_bytes)]
        numbers[some] = pieces.view(f"<u{n_bytes}")[:, 0]
    return numbers


def _names(summary: bytes, at: I64, n_bytes: I64) -> tuple[tuple[str, ...], I64]:
    """The different compressions, and which of them each chunk has."""
    size = int(n_bytes.max(initial=0))
    if len(at) and size <= _SHORT and (n_bytes == size).all():
        data, first = np.frombuffer(summary, np.uint8), int(at[0])
        if (data[at[:, None] + np.arange(size)] == data[first : first + size]).all():
            return (summary[first : first + size].decode(errors="replace"),), np.zeros(len(at), np.int64)
    texts = [summary[a:b] for a, b in zip(at.tolist(), (at + n_bytes).tolist(), strict=True)]
    codes = {text: k for k, text in enumerate(dict.fromkeys(texts))}
    names = tuple(text.decode(errors="replace") for text in codes)
    return names, np.fromiter((codes[text] for text in texts), np.int64, len(texts))


def _counts(data: U8, at: I64, n_entries: I64, stop: I64, size_bytes: int) -> tuple[I64, I64]:
    """Channel and number of messages of each entry: how long its index record is, up to the next one's
    start or the chunk's ``stop``.
    """
    first = np.cumsum(n_entries) - n_entries
    ordinal = np.repeat(np.arange(len(at)), n_entries)
    places = at[ordinal] + _PLACE_BYTES * (np.arange(len(ordinal)) - first[ordinal])
    ids, begin = numbers_at(data, places, 2).astype(np.int64), numbers_at(data, places + 2, 8)
    demand((begin <= np.uint64(size_bytes)).all(), "a message index beyond the file's end")
    starts = begin.astype(np.int64)
    if ((np.diff(starts) < 0) & (np.diff(ordinal) == 0)).any():
        order = np.lexsort((starts, ordinal))
        ids, starts = ids[order], starts[order]
    is_last = np.diff(ordinal, append=-1) != 0
    end = np.where(is_last, stop[ordinal], np.append(starts[1:], 0))
    return ids, np.maximum(end - starts - _INDEX_HEAD_BYTES, 0) // _INDEX_ENTRY_BYTES
