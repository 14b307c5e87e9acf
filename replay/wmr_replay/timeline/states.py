"""State lanes: modes and status, logged at the exact rows where they change."""

from dataclasses import dataclass

import polars as pl
import rerun as rr

from wmr_replay.timeline.colours import MODE_COLOURS, STATUS_COLOURS, Colour, mode_name

_MODE_NAMES = {int(mode): mode_name(mode) for mode in MODE_COLOURS}


@dataclass(frozen=True)
class Lane:
    """One lane of the state view: its entity, where its names come from, and their colours."""

    entity: str
    state: pl.Expr
    colours: dict[str, Colour]

    def configuration(self) -> rr.StateConfiguration:
        """Labels and colours of the lane's states."""
        names = list(self.colours)
        return rr.StateConfiguration(values=names, labels=names, colors=list(self.colours.values()))


def mode_lane(entity: str, column: str) -> Lane:
    """A lane of the contact mode in ``column``."""
    names = pl.col(column).replace_strict(_MODE_NAMES, default=None, return_dtype=pl.String)
    return Lane(entity, names, {mode_name(mode): colour for mode, colour in MODE_COLOURS.items()})


def status_lane(entity: str) -> Lane:
    """A lane of the status."""
    names = pl.col("status").cast(pl.String).str.replace_all("_", " ")
    return Lane(
        entity, names, {status.label.replace("_", " "): colour for status, colour in STATUS_COLOURS.items()}
    )


HINDSIGHT_LANE = mode_lane("/mode/hindsight", "mode")
"""Between the estimated and the true mode, by the alphabet."""
LANES: tuple[Lane, ...] = (
    mode_lane("/mode/true", "mode_true"),
    mode_lane("/mode/estimated", "mode"),
    status_lane("/status"),
)


class Changes:
    """Finds the rows where a lane's state differs from the row before, across batches.

    Only rows where a column that it is read from changes are asked for the state.
    """

    def __init__(self, lane: Lane) -> None:
        self.lane = lane
        self._reads = lane.state.meta.root_names()
        self._last: str | None = None

    def push(self, samples: pl.DataFrame) -> pl.DataFrame:
        """Rows (t_ns, state) at which a known state begins."""
        read = samples.select(self._reads)
        changes = pl.any_horizontal(pl.all().ne_missing(pl.all().shift(1))) | (pl.int_range(pl.len()) == 0)
        rows = samples.filter(read.select(changes).to_series()).select("t_ns", state=self.lane.state)
        before = rows["state"].shift(1, fill_value=self._last)
        self._last = rows["state"][-1]
        return rows.filter(rows["state"].ne_missing(before) & rows["state"].is_not_null())
