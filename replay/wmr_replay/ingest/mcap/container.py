"""What a log file of another format offers in order to be read as an MCAP file is."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path

from wmr_replay.ingest.mcap.chunks import Span, SpanFile
from wmr_replay.ingest.mcap.survey import Survey
from wmr_schemas.arrays import U8


class SampledFile(SpanFile):
    """A file whose spans do not tell how many messages of which channel they hold."""

    @abstractmethod
    def first_messages(self, survey: Survey, n_later: int, within: Sequence[Span] | None) -> U8:
        """Records of the first messages, and of ``n_later`` of each channel that begins later, where
        ``within`` is given as far as these spans hold them.
        """


class Container(ABC):
    """A log file of another format: surveyed once, opened by each thread that reads its spans."""

    def __init__(self, path: Path, shown: str = "") -> None:
        self.path, self.name = path, shown or path.name
        self.wanted: frozenset[int] | None = None
        """Channels whose data are asked for; None for all. A format may give more."""

    def __str__(self) -> str:
        return str(self.path)

    @property
    def size_bytes(self) -> int:
        """Size of the file."""
        return self.path.stat().st_size

    @abstractmethod
    def survey(self) -> Survey:
        """Channels, schemas and spans, and what is wrong with the file. Raises LogUnusable."""

    @abstractmethod
    def open(self, mode: str = "rb") -> SpanFile:
        """The file, opened for the calling thread."""

    def want(self, channel_ids: frozenset[int]) -> None:
        """From now on the data of these channels alone are asked for; of others, messages are counted."""
        self.wanted = channel_ids
