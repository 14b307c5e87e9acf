"""Segments: maximal stretches of one estimated mode, collected from batches of the samples table."""

import polars as pl

from wmr_schemas.modes import MODES
from wmr_schemas.tables import SEGMENTS, polars_schema

NS_PER_S = 1e9


class SegmentCollector:
    """``push(samples)`` batches in order; ``finish()`` gives the segments table."""

    def __init__(self) -> None:
        self._parts: list[pl.DataFrame] = []

    def push(self, samples: pl.DataFrame) -> None:
        """Reduce a batch to its stretches of one mode."""
        p_of_mode = pl.coalesce(
            pl.when(pl.col("mode") == int(mode)).then(f"p_{mode.label}") for mode in MODES
        )
        stretches = samples.select("t_ns", "mode", "alpha", "alpha_sd", p=p_of_mode)
        counted = {"n": pl.lit(1, pl.Int64), "n_known": pl.col("p").is_not_null().cast(pl.Int64)}
        self._parts.append(reduce_stretches(stretches.with_columns(**counted, last_ns=pl.col("t_ns"))))

    def finish(self) -> pl.DataFrame:
        """The segments table; a stretch that spans several batches is one segment."""
        if not self._parts:
            return pl.DataFrame(schema=polars_schema(SEGMENTS))
        segments = reduce_stretches(pl.concat(self._parts))
        end = pl.col("t_ns").shift(-1).fill_null(pl.col("last_ns"))
        named = with_seconds(
            segments.select(
                start_ns="t_ns",
                end_ns=end,
                duration_s=(end - pl.col("t_ns")) / NS_PER_S,
                mode="mode",
                mean_p="p",
                alpha="alpha",
                alpha_sd="alpha_sd",
                n_samples="n",
            )
        )
        return named.cast(polars_schema(SEGMENTS))


def with_seconds(segments: pl.DataFrame) -> pl.DataFrame:
    """The table with ``start_s`` and ``end_s``, in s from the log's first sample, behind the stamps.

    Tables written before these columns existed lack them. The first segment starts at the first sample.
    """
    if "start_s" in segments.columns:
        return segments
    first_ns = pl.col("start_ns").first()
    seconds = [
        ((pl.col(ns) - first_ns) / NS_PER_S).alias(s)
        for ns, s in (("start_ns", "start_s"), ("end_ns", "end_s"))
    ]
    stamps = ("start_ns", "end_ns")
    return segments.select(*stamps, *seconds, pl.exclude(stamps))


def reduce_stretches(rows: pl.DataFrame) -> pl.DataFrame:
    """Rows of consecutive equal mode as one; ``p`` is the mean over ``n_known``, the rows that have it."""
    weighted = (pl.col("p") * pl.col("n_known")).sum() / pl.col("n_known").sum()
    return (
        rows.group_by(pl.col("mode").rle_id().alias("stretch"), maintain_order=True)
        .agg(
            pl.col("t_ns", "mode").first(),
            pl.col("alpha", "alpha_sd", "last_ns").last(),
            pl.when(pl.col("n_known").sum() > 0).then(weighted).alias("p"),
            pl.col("n", "n_known").sum(),
        )
        .select("t_ns", "mode", "alpha", "alpha_sd", "p", "n", "n_known", "last_ns")
    )
