"""Losses of a log: messages, chunks and efforts that could not be used, as counts and notes."""

from dataclasses import dataclass, field

_MAX_NOTES = 100


@dataclass
class Losses:
    """Counters as in the summary table, and notes saying what, where and how many."""

    n_undecodable: int = 0
    n_chunks_damaged: int = 0
    n_torque_empty: int = 0
    truncated: bool = False
    notes: list[str] = field(default_factory=list)

    def any(self) -> bool:
        """Whether anything in the file was damaged or lost. An effort that was never recorded is no loss."""
        return bool(self.n_undecodable or self.n_chunks_damaged or self.truncated or self.notes)

    def counts(self) -> dict[str, int | bool]:
        """The counters by their column in the summary table."""
        return {
            "n_undecodable": self.n_undecodable,
            "n_chunks_damaged": self.n_chunks_damaged,
            "n_torque_empty": self.n_torque_empty,
            "truncated": self.truncated,
        }

    def note(self, text: str) -> None:
        """Add a note; after 100 notes one line stands for the others."""
        if len(self.notes) < _MAX_NOTES:
            self.notes.append(text)
        elif len(self.notes) == _MAX_NOTES:
            self.notes.append("… and more of the like")
