"""The files of a log, each surveyed and sampled by itself, and joined as one.

The files of one recording may number their channels differently. Channels of equal topic, schema and
encoding are one channel; within a file they stay apart.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from wmr_replay.ingest.mcap.catalogue import Catalogue
from wmr_replay.ingest.mcap.chunk_index import ChunkIndex, joined
from wmr_replay.ingest.mcap.chunks import Span
from wmr_replay.ingest.mcap.container import Container
from wmr_replay.ingest.mcap.index_survey import surveyed
from wmr_replay.ingest.mcap.records import Channel
from wmr_replay.ingest.mcap.sampling import Sample, Sampler
from wmr_replay.ingest.mcap.survey import Survey
from wmr_replay.ingest.mcap.walk import N_CHANNEL_IDS
from wmr_replay.ingest.storage.source import LogPath, size_of
from wmr_schemas.arrays import I64

Identity = tuple[str, str, str, int]
"""Topic, schema name, message encoding, and a number for channels that share all three."""


@dataclass
class LogFiles:
    """The files; their spans, channels, metadata and problems as one :class:`Survey`; samples by channel.

    ``ids[k]`` gives the common id of each channel id of file k, or None where it is the same.
    """

    paths: list[LogPath | Container]
    survey: Survey
    ids: list[I64 | None]
    samples: dict[int, list[Sample]] = field(default_factory=dict)
    n_messages: dict[int, int] = field(default_factory=dict)

    def want(self, channel_ids: set[int]) -> None:
        """The channels in use, by common id; of others, messages are counted, where that is less work."""
        for path, ids in zip(self.paths, self.ids, strict=True):
            if isinstance(path, Container):
                wanted = channel_ids if ids is None else np.flatnonzero(np.isin(ids, list(channel_ids)))
                path.want(frozenset(map(int, wanted)))

    def sizes(self) -> list[int]:
        """Size of each file in bytes."""
        return [path.size_bytes if isinstance(path, Container) else size_of(path) for path in self.paths]


def join_files(paths: list[LogPath | Container], *, by_index: bool = False) -> LogFiles:
    """Survey and sample the files of one log, and join them. ``by_index``: see :func:`surveyed`."""
    surveys = [surveyed(path, by_index=by_index) for path in paths]
    samplers = [Sampler(found) for found in surveys]
    for path, sampler in zip(paths, samplers, strict=True):
        sampler.run(path, in_part=by_index)
    if len(paths) == 1:
        samples, counts = samplers[0].samples, samplers[0].known_messages()
        return LogFiles(paths, surveys[0], [None], samples, counts)
    return _Joiner(paths).run(surveys, samplers)


class _Joiner:
    """Joins surveys and samples of several files under common channel ids."""

    def __init__(self, paths: list[LogPath | Container]) -> None:
        self.known: dict[Identity, int] = {}
        self.files = LogFiles(paths, Survey(0), [])
        self.spans: list[Sequence[Span]] = []

    def run(self, surveys: list[Survey], samplers: list[Sampler]) -> LogFiles:
        """The joined files, in the order of their paths."""
        for k, (found, sampler) in enumerate(zip(surveys, samplers, strict=True)):
            ids = self._common_ids(found.catalogue)
            self.files.ids.append(ids)
            self._add(k, found, ids)
            for channel_id, more in sampler.known_messages().items():
                common = int(ids[channel_id])
                self.files.samples.setdefault(common, []).extend(sampler.samples.get(channel_id, ()))
                self.files.n_messages[common] = self.files.n_messages.get(common, 0) + more
        self.files.survey.spans = _joined(self.spans)
        return self.files

    def _common_ids(self, catalogue: Catalogue) -> I64:
        """The common id of each of the file's; new channels keep theirs where it is free."""
        ids, met = np.arange(N_CHANNEL_IDS), Counter[tuple[str, str, str]]()
        joined = self.files.survey.catalogue
        for channel_id, channel in sorted(catalogue.channels.items()):
            schema = catalogue.schemas.get(channel.schema_id)
            what = channel.topic, schema.name if schema else "", channel.message_encoding
            identity = (*what, met[what])
            met[what] += 1
            if identity not in self.known:
                common = _free(channel_id, joined.channels)
                self.known[identity] = common
                joined.channels[common] = replace(
                    channel, id=common, schema_id=common if channel.schema_id else 0
                )
                if schema is not None:
                    joined.schemas[common] = replace(schema, id=common)
            ids[channel_id] = self.known[identity]
        return ids

    def _add(self, k: int, found: Survey, ids: I64) -> None:
        """A file's spans, metadata and problems."""
        whole, name = self.files.survey, self.files.paths[k].name
        whole.size_bytes += found.size_bytes
        whole.profile, whole.library = whole.profile or found.profile, whole.library or found.library
        whole.metadata = found.metadata | whole.metadata
        self.spans.append(_moved(found.spans, k, ids))
        whole.truncated |= found.truncated
        whole.n_chunks_damaged += found.n_chunks_damaged
        whole.strays.add(found.strays)
        whole.notes += [f"{name}: {note}" for note in found.notes]
        whole.catalogue.n_malformed += found.catalogue.n_malformed
        if found.statistics is None or (k and whole.statistics is None):
            whole.statistics = None
            return
        counts = Counter({int(ids[channel_id]): n for channel_id, n in found.statistics.items()})
        whole.statistics = dict(Counter(whole.statistics or {}) + counts)


def _moved(spans: Sequence[Span], file_index: int, ids: I64) -> Sequence[Span]:
    """The spans of a file with its index, and counts by common channel ids."""
    if isinstance(spans, ChunkIndex):
        return spans.moved(file_index, ids)
    counts = ({int(ids[channel_id]): n for channel_id, n in span.counts.items()} for span in spans)
    return [replace(span, file_index=file_index, counts=own) for span, own in zip(spans, counts, strict=True)]


def _joined(parts: Sequence[Sequence[Span]]) -> Sequence[Span]:
    """The spans of all files, one file after another; in columns where they are in all of them."""
    indexes = [part for part in parts if isinstance(part, ChunkIndex)]
    return joined(indexes) if len(indexes) == len(parts) else [span for part in parts for span in part]


def _free(wanted: int, taken: dict[int, Channel]) -> int:
    """``wanted``, or the first id that no channel has."""
    return wanted if wanted not in taken else next(k for k in range(1, N_CHANNEL_IDS) if k not in taken)
