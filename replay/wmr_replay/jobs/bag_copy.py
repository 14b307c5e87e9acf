"""A log's messages as an MCAP file: the same bytes, channels, definitions and times."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from mcap.writer import Writer

from wmr_replay.ingest import LogReader
from wmr_replay.ingest.mcap.chunks import Block, Span, load
from wmr_replay.ingest.mcap.walk import walk
from wmr_replay.ingest.mcap.workspace import Workspace
from wmr_schemas.files import whole_file

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Copied:
    """How many messages were written, those of channels that the log does not describe, and what was lost."""

    n_messages: int
    n_undescribed: int
    notes: tuple[str, ...]


def copy_as_mcap(reader: LogReader, target: Path, progress: Progress | None = None) -> Copied:
    """Write all messages of a log to ``target``, whole or not at all. Messages are written one by one."""
    with whole_file(target) as part, part.open("wb") as file:
        writer = Writer(file)
        writer.start(profile=reader.survey.profile, library="wmr-replay")
        for name, content in reader.survey.metadata.items():
            writer.add_metadata(name, content)
        copied = _Copy(reader, writer).run(progress)
        writer.finish()  # type: ignore[no-untyped-call]
    return copied


class _Copy:
    """One copy in progress."""

    def __init__(self, reader: LogReader, writer: Writer) -> None:
        self.reader, self.writer = reader, writer
        self.n_messages, self.n_undescribed, self.notes = 0, 0, list(reader.survey.notes)
        self.channels = self._registered()

    def _registered(self) -> dict[int, int]:
        """The new file's channel of each channel."""
        catalogue = self.reader.survey.catalogue
        found = {}
        for channel_id, channel in sorted(catalogue.channels.items()):
            schema, schema_id = catalogue.schemas.get(channel.schema_id), 0
            if schema is not None:
                schema_id = self.writer.register_schema(schema.name, schema.encoding, schema.data)
            found[channel_id] = self.writer.register_channel(
                channel.topic, channel.message_encoding, schema_id
            )
        return found

    def run(self, progress: Progress | None) -> Copied:
        """Copy span after span."""
        files, workspace, done = self.reader.files, Workspace(), 0
        files.want(set(self.channels))
        for k, path in enumerate(files.paths):
            with path.open("rb") as file:
                for span in (span for span in self.reader.survey.spans if span.file_index == k):
                    self._copy(load(file, span, workspace), span)
                    done += span.data_bytes
                    if progress is not None:
                        progress(min(done, self.reader.size_bytes), self.reader.size_bytes)
        return Copied(self.n_messages, self.n_undescribed, tuple(self.notes))

    def _copy(self, block: Block, span: Span) -> None:
        """Copy the messages of one span."""
        if block.problem:
            self.notes.append(f"{span.name or f'the chunk at byte {span.offset}'}: {block.problem}")
        found, data = walk(block.data).messages, block.data.tobytes()
        ids = self.reader.files.ids[span.file_index]
        channels = found.channel if ids is None else ids[found.channel]
        columns = channels, found.offset, found.length, found.log_ns, found.publish_ns
        rows = zip(*(column.tolist() for column in columns), strict=True)
        for channel, offset, length, log_ns, publish_ns in rows:
            if channel not in self.channels:
                self.n_undescribed += 1
                continue
            message = data[offset : offset + length]
            self.writer.add_message(self.channels[channel], log_ns, message, publish_ns, self.n_messages)
            self.n_messages += 1
