"""Segments: maximal stretches of one estimated mode, gathered while rows stream by."""

import polars as pl

from wmr_schemas.tables import SEGMENTS, polars_schema

NS_PER_S = 1e9
P_OF_MODE = ("p_ideal", "p_skidding", "p_slipping", "p_skidding_slipping")


class SegmentCollector:
    """``push(samples)`` batches in order; ``finish()`` gives the segments table."""

    def __init__(self) -> None:
        self._parts: list[pl.DataFrame] = []

    def push(self, samples: pl.DataFrame) -> None:
        """Reduce a batch to its stretches."""
        mode = pl.col("mode")
        chosen = pl.when(mode == 0).then("p_ideal").when(mode == 1).then("p_skidding")
        chosen = chosen.when(mode == 2).then("p_slipping").when(mode == 3).then("p_skidding_slipping")
        stretches = samples.select("t_ns", "mode", "alpha", "alpha_sd", chosen.otherwise(None).alias("p"))
        self._parts.append(
            reduce_stretches(stretches.with_columns(n=pl.lit(1, pl.Int64), last_ns=pl.col("t_ns")))
        )

    def finish(self) -> pl.DataFrame:
        """The table, stretches that batches cut in two joined again."""
        if not self._parts:
            return pl.DataFrame(schema=polars_schema(SEGMENTS))
        segments = reduce_stretches(pl.concat(self._parts))
        end = pl.col("t_ns").shift(-1).fill_null(pl.col("last_ns"))
        named = segments.select(
            start_ns="t_ns",
            end_ns=end,
            duration_s=(end - pl.col("t_ns")) / NS_PER_S,
            mode="mode",
            mean_p="p",
            alpha="alpha",
            alpha_sd="alpha_sd",
            n_samples="n",
        )
        return named.cast(polars_schema(SEGMENTS))


def reduce_stretches(rows: pl.DataFrame) -> pl.DataFrame:
    """Rows of consecutive equal mode as one; ``p`` as the mean weighted by ``n``."""
    weighted = (pl.col("p") * pl.col("n")).sum() / pl.col("n").filter(pl.col("p").is_not_null()).sum()
    return (
        rows.group_by(pl.col("mode").rle_id().alias("stretch"), maintain_order=True)
        .agg(
            pl.col("t_ns", "mode").first(),
            pl.col("alpha", "alpha_sd", "last_ns").last(),
            pl.when(pl.col("p").is_not_null().any()).then(weighted).alias("p"),
            pl.col("n").sum(),
        )
        .select("t_ns", "mode", "alpha", "alpha_sd", "p", "n", "last_ns")
    )
