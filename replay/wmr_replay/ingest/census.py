"""Messages by channel as they are read: how many, and when."""

from dataclasses import dataclass, field

from wmr_replay.ingest.walk import Messages
from wmr_schemas.arrays import NS_PER_S


@dataclass
class Tally:
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
class Census:
    """Tallies by channel id."""

    tallies: dict[int, Tally] = field(default_factory=dict)

    def add(self, messages: Messages) -> None:
        """Count one block's messages."""
        for channel_id, n in messages.counts().items():
            log_ns = messages.log_ns[messages.channel == channel_id]
            first, last = int(log_ns.min()), int(log_ns.max())
            old = self.tallies.get(channel_id, Tally(0, first, last))
            self.tallies[channel_id] = Tally(old.n + n, min(old.first_ns, first), max(old.last_ns, last))
