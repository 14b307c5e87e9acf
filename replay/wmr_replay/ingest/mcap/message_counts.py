"""Number and times of the messages of each channel, counted as they are read; and what the file claims."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from wmr_replay.ingest.mcap.walk import N_CHANNEL_IDS
from wmr_schemas.arrays import I64, NS_PER_S

_LATEST, _EARLIEST = np.iinfo(np.int64).max, np.iinfo(np.int64).min


@dataclass(frozen=True)
class ChannelCount:
    """Messages of one channel, by log time."""

    n: int
    first_ns: int
    last_ns: int

    @property
    def duration_s(self) -> float:
        """From the earliest to the latest message."""
        return (self.last_ns - self.first_ns) / NS_PER_S

    @property
    def rate_hz(self) -> float | None:
        """Mean rate; None for fewer than two instants."""
        return (self.n - 1) / self.duration_s if self.last_ns > self.first_ns else None


@dataclass
class MessageCounts:
    """Messages by channel id (65536,): how many, first and last log time in ns."""

    n: I64 = field(default_factory=lambda: np.zeros(N_CHANNEL_IDS, np.int64))
    first_ns: I64 = field(default_factory=lambda: np.full(N_CHANNEL_IDS, _LATEST, np.int64))
    last_ns: I64 = field(default_factory=lambda: np.full(N_CHANNEL_IDS, _EARLIEST, np.int64))

    def add(self, other: "MessageCounts") -> None:
        """Add the counts of another instance."""
        self.n += other.n
        np.minimum(self.first_ns, other.first_ns, out=self.first_ns)
        np.maximum(self.last_ns, other.last_ns, out=self.last_ns)

    @property
    def by_channel(self) -> dict[int, ChannelCount]:
        """Counts by channel id, of channels that have messages."""
        return {
            k: ChannelCount(int(self.n[k]), int(self.first_ns[k]), int(self.last_ns[k]))
            for k in np.flatnonzero(self.n).tolist()
        }


def differing_counts(
    found: Mapping[int, ChannelCount], claims: Mapping[str, Mapping[int, int]], channels: Iterable[int]
) -> Iterator[tuple[int, str]]:
    """Channels of which other numbers of messages were found than the file claims, with a text each.

    ``claims`` are the messages by channel id of each source that covers the whole file, by the source's name.
    """
    for channel in sorted(channels):
        n = found[channel].n if channel in found else 0
        others = [(name, counts.get(channel, 0)) for name, counts in claims.items()]
        said = " and ".join(f"{name} {count}" for name, count in others if count != n)
        if said:
            yield channel, f"{n} messages were found; the file claims more or fewer: {said}"
