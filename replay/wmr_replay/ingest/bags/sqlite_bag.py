"""ROS 2 bags in SQLite form (``.db3``), presented as spans of message records.

Tables: ``topics`` (id, name, type, serialization_format), ``messages`` (id, topic_id, timestamp, data) and,
since ROS 2 Iron, ``message_definitions``. A span is a range of row ids, which is the order of recording.
Data are fetched for the channels in use alone; other messages are counted.
"""

import sqlite3
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

import numpy as np

from wmr_replay.ingest.bags.definitions import standard_schema
from wmr_replay.ingest.bags.message_records import joined
from wmr_replay.ingest.bags.packed_messages import unpacked
from wmr_replay.ingest.mcap.chunks import Block, Span
from wmr_replay.ingest.mcap.container import Container, SampledFile
from wmr_replay.ingest.mcap.records import Channel, Schema
from wmr_replay.ingest.mcap.survey import Survey
from wmr_replay.ingest.mcap.walk import N_CHANNEL_IDS
from wmr_replay.ingest.mcap.workspace import Workspace
from wmr_schemas.arrays import U8
from wmr_schemas.errors import LogUnusable

Row = tuple[int, int, bytes]
"""Topic id, time of reception in ns, and data of one message."""
_SPAN_BYTES, _MOST_ROWS, _FEWEST_ROWS = 1 << 20, 1 << 12, 16
_LONGEST_SAMPLE = 1 << 18
_LEAST_ROW_BYTES = 8
"""No row of the table takes less room in the file."""
_FETCHED = 256
_LOST_SPANS = 64
"""So many spans in a row that cannot be read end the search for rows in a damaged file."""
_DAMAGED = (sqlite3.DatabaseError, OverflowError, UnicodeDecodeError)
"""What SQLite raises on a damaged file; its own messages may quote bytes that are not UTF-8."""
_ANY = "SELECT name FROM sqlite_master LIMIT 1"
_TYPED = "CAST(topic_id AS INTEGER), CAST(timestamp AS INTEGER)"
_ALL = f"SELECT {_TYPED}, CAST({{data}} AS BLOB) FROM messages WHERE rowid BETWEEN ? AND ? ORDER BY rowid"
_OF_TOPIC = "FROM messages WHERE topic_id = ? AND rowid > ? ORDER BY rowid LIMIT ?"
_TOPICS = "SELECT CAST(topic_id AS INTEGER), rowid FROM messages WHERE rowid BETWEEN ? AND ? ORDER BY rowid"
_ENDS = "SELECT (SELECT min(rowid) FROM messages), (SELECT max(rowid) FROM messages)"
_LATER = f"SELECT {_TYPED}, CAST(data AS BLOB) {_OF_TOPIC}"


@dataclass(frozen=True)
class RowSpan(Span):
    """The messages of the row ids ``offset`` to ``last_row``."""

    last_row: int = 0

    @property
    def rows(self) -> tuple[int, int]:
        """First and last row id."""
        return self.offset, self.last_row

    @property
    def n_rows(self) -> int:
        """Row ids from first to last."""
        return self.last_row - self.offset + 1


class SqliteBag(Container):
    """A ``.db3`` file."""

    def open(self, mode: str = "rb") -> "SqliteFile":
        """A connection of its own for the calling thread."""
        return SqliteFile(self)

    def survey(self) -> Survey:
        """Topics with their definitions, and ranges of ids. Raises LogUnusable."""
        found = Survey(self.size_bytes, "ros2", "rosbag2 in SQLite form")
        try:
            with closing(connect(self.path)) as connection:
                _enter_topics(found, connection)
                found.spans = _spans(found, connection)
        except _DAMAGED as error:
            advice = "If it was being recorded, close the recorder first; else copy it again."
            raise LogUnusable(self.path, f"its database cannot be read ({error})", advice) from None
        return found


def connect(path: Path) -> sqlite3.Connection:
    """A connection that reads alone. Without rights for a journal the file is read as it stands.

    SQLite refuses a file that is shorter than it says, unless its schema may be damaged, too
    (``writable_schema``).
    """
    place = f"file:{quote(str(path.absolute()))}?mode=ro"
    connection = _connection(place)
    try:
        connection.execute(_ANY).fetchall()
    except sqlite3.OperationalError:
        connection.close()
        connection = _connection(f"{place}&immutable=1")
    except _DAMAGED:
        connection.execute("PRAGMA writable_schema = ON")
    return connection


def _connection(place: str) -> sqlite3.Connection:
    """A connection without trust in the file's schema; bytes that are not UTF-8 are replaced in texts."""
    connection = sqlite3.connect(place, uri=True, check_same_thread=False)
    connection.text_factory = _replaced
    with suppress(*_DAMAGED):
        connection.execute("PRAGMA trusted_schema = OFF")
    return connection


def _replaced(text: bytes) -> str:
    """A text of the file."""
    return text.decode(errors="replace")


def _enter_topics(found: Survey, connection: sqlite3.Connection) -> None:
    """Channels and schemas; the channel's id is the topic's. Raises LogUnusable, sqlite3.DatabaseError."""
    tables = {name for (name,) in connection.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    if not {"topics", "messages"} <= tables:
        file = connection.execute("PRAGMA database_list").fetchall()[0][2]
        raise LogUnusable(file, "this is an SQLite file, but no ROS 2 bag: it lacks topics or messages")
    definitions = _definitions(connection) if "message_definitions" in tables else {}
    query = "SELECT CAST(id AS INTEGER), name, type, serialization_format FROM topics ORDER BY id"
    for topic_id, *rest in connection.execute(query):
        if not 0 < topic_id < N_CHANNEL_IDS:
            found.notes.append(f"a topic of id {topic_id} is left out")
            continue
        topic, kind, encoding = (_text(value) for value in rest)
        language, text = definitions.get(kind, ("", b""))
        schema = Schema(topic_id, kind, language, text) if text else standard_schema(topic_id, kind)
        found.catalogue.schemas[topic_id] = schema
        found.catalogue.channels[topic_id] = Channel(topic_id, topic_id, topic, encoding)


def _definitions(connection: sqlite3.Connection) -> dict[str, tuple[str, bytes]]:
    """Language and text of the definitions that the bag holds, by type."""
    query = "SELECT topic_type, encoding, CAST(encoded_message_definition AS BLOB) FROM message_definitions"
    return {_text(name): (_text(language), text or b"") for name, language, text in connection.execute(query)}


def _text(value: object) -> str:
    """A column that should be text, whatever type the file gives it."""
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)


def _spans(found: Survey, connection: sqlite3.Connection) -> list[RowSpan]:
    """Ranges of ids of about equal size in bytes; the first span has the log's times."""
    try:
        first, last = connection.execute(_ENDS).fetchone()  # one aggregate in each: a look-up, and no scan
        first_ns = None if first is None else _first_ns(connection, first)
    except _DAMAGED as error:
        return _surviving(found, connection, str(error))
    if first is None:
        return []
    if last - first >= found.size_bytes // _LEAST_ROW_BYTES:
        raise sqlite3.DatabaseError(f"ids from {first} to {last} in {found.size_bytes} bytes")
    n_rows = last - first + 1
    n_spans = max(found.size_bytes // _SPAN_BYTES, n_rows // _MOST_ROWS) + 1
    step = max(-(-n_rows // n_spans), _FEWEST_ROWS)
    size = found.size_bytes * step // n_rows
    times_ns = None if first_ns is None else (int(first_ns), int(first_ns))
    return [
        _span(start, min(start + step - 1, last), size * k, size, times_ns if k == 0 else None)
        for k, start in enumerate(range(first, last + 1, step))
    ]


def _first_ns(connection: sqlite3.Connection, first: int) -> int | None:
    """The earliest time of reception: by the index that rosbag2 makes, else of the first rows."""
    indexes = [name for _, name, *_ in connection.execute("PRAGMA index_list(messages)")]
    leading = [
        connection.execute("SELECT name FROM pragma_index_info(?) WHERE seqno = 0", (name,)).fetchone()
        for name in indexes
    ]
    query = "SELECT min(timestamp) FROM messages"
    if ("timestamp",) not in leading:
        query += f" WHERE rowid < {first + _MOST_ROWS}"
    (found,) = connection.execute(query).fetchone()
    return None if found is None else int(found)


def _span(
    first: int, last: int, position: int, size: int, times_ns: tuple[int, int] | None = None
) -> RowSpan:
    """The span of the rows ``first`` to ``last``, which take about ``size`` bytes."""
    name = f"the range of rows {first} to {last}"
    return RowSpan(first, position, size, times_ns=times_ns, name=name, last_row=last)


def _surviving(found: Survey, connection: sqlite3.Connection, problem: str) -> list[RowSpan]:
    """The ranges up to the last row that can be read, in a file whose last id cannot."""
    step, spans, n_lost, start = _MOST_ROWS // 4, list[RowSpan](), 0, 1
    query = "SELECT min(timestamp), count(*) FROM messages WHERE rowid BETWEEN ? AND ?"
    while n_lost < _LOST_SPANS:
        try:
            first_ns, n_rows = connection.execute(query, (start, start + step - 1)).fetchone()
        except _DAMAGED:
            n_rows, first_ns = 0, None
        n_lost = 0 if n_rows else n_lost + 1
        times_ns = None if first_ns is None or any(s.times_ns for s in spans) else (int(first_ns),) * 2
        spans.append(_span(start, start + step - 1, 0, found.size_bytes, times_ns))
        start += step
    kept = spans[: len(spans) - n_lost + 1]
    if len(kept) == 1 and not any(span.times_ns for span in kept):
        raise sqlite3.DatabaseError(problem)
    found.truncated = True
    lost = start - n_lost * step
    found.notes.append(f"its database is damaged ({problem}); most rows from row {lost} on are lost")
    return kept


class SqliteFile(SampledFile):
    """A ``.db3`` file as one thread reads it."""

    def __init__(self, bag: SqliteBag) -> None:
        self.bag, self.connection = bag, connect(bag.path)

    def load(self, span: Span, workspace: Workspace) -> Block:
        """The messages of a range of ids; those before a damaged place are kept."""
        if not isinstance(span, RowSpan):
            raise TypeError(f"no span of rows: {span}")
        rows, problem = self._rows(_ALL.format(data=self._data()), span.rows)
        sound = _sound(rows)
        if len(sound) < len(rows):
            problem = problem or f"{len(rows) - len(sound)} rows name no topic or time"
        return Block(span, _records(sound), problem)

    def _data(self) -> str:
        """The SQL expression of a message's data: of channels in use, or of messages of sensible size."""
        if self.bag.wanted is None:
            return f"CASE WHEN length(data) <= {_LONGEST_SAMPLE} THEN data END"
        ids = ", ".join(map(str, sorted(self.bag.wanted)))
        return f"CASE WHEN topic_id IN ({ids}) THEN data END"

    def first_messages(self, survey: Survey, n_later: int, within: Sequence[Span] | None) -> U8:
        """The messages of the first span, and ``n_later`` of each topic that it lacks."""
        span = next(iter(survey.spans), None)
        if not isinstance(span, RowSpan):
            return _records([])
        rows, _ = self._rows(_ALL.format(data=self._data()), span.rows)
        met = Counter(row[0] for row in rows)
        lacking = {k for k in survey.catalogue.channels if met[k] < n_later}
        if within is not None:
            others = [other for other in within if other.offset > span.last_row]
            return _records(_sound(rows + self._first_within(lacking, n_later, others)))
        for topic_id in sorted(lacking):
            rows += self._rows(_LATER, (topic_id, span.last_row, n_later))[0]
        return _records(_sound(rows))

    def _first_within(self, lacking: set[int], n_wanted: int, within: Sequence[Span]) -> list[Row]:
        """``n_wanted`` messages of each topic that is ``lacking``, as far as these spans hold them."""
        wanted, met = list[int](), Counter[int]()
        for span in within:
            for topic_id, row in self._topics(span):
                if topic_id in lacking and met[topic_id] < n_wanted:
                    met[topic_id] += 1
                    wanted.append(row)
        query = _ALL.format(data=self._data())
        return [row for place in wanted for row in self._rows(query, (place, place))[0]]

    def _topics(self, span: Span) -> list[tuple[int, int]]:
        """Topic and row id of the rows of a span; none where the file is damaged."""
        bounds = span.offset, span.offset + span.n_rows - 1
        try:
            return self.connection.execute(_TOPICS, bounds).fetchall()
        except _DAMAGED:
            return []

    def _rows(self, query: str, values: tuple[int, ...]) -> tuple[list[Row], str]:
        """The rows of a query, and why there are no more where the file is damaged."""
        rows: list[Row] = []
        try:
            for some in _fetched(self.connection.execute(query, values)):
                rows += some
        except _DAMAGED as error:
            return rows, str(error)
        return rows, ""

    def close(self) -> None:
        """Close the connection."""
        self.connection.close()


def _fetched(cursor: sqlite3.Cursor) -> Iterator[list[Row]]:
    """Rows, some at a time."""
    while rows := cursor.fetchmany(_FETCHED):
        yield rows


def _sound(rows: list[Row]) -> list[Row]:
    """The rows that have a time and a topic of a possible id."""
    topics = {row[0] for row in rows}
    if all(topic is not None and 0 < topic < N_CHANNEL_IDS for topic in topics):
        return rows if all(row[1] is not None for row in rows) else [r for r in rows if r[1] is not None]
    return [row for row in rows if None not in row[:2] and 0 < row[0] < N_CHANNEL_IDS]


def _records(rows: Sequence[Row]) -> U8:
    """Rows as message records."""
    topics, times, data = zip(*rows, strict=True) if rows else ((), (), ())
    messages = unpacked([piece or b"" for piece in data])
    return joined(np.array(topics, np.int64), np.array(times, np.int64), messages)
