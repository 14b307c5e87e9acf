"""Two results in one recording."""

from wmr_replay.timeline.comparison.text import comparison_text
from wmr_replay.timeline.comparison.writer import Side, write_comparison

__all__ = ["Side", "comparison_text", "write_comparison"]
