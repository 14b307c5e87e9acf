"""Two results in one recording: b − a at one instant, and times that are matched."""

import numpy as np
import polars as pl
from rerun.chunk import RrdReader

from wmr_replay.timeline.comparison import Side, write_comparison
from wmr_replay.timeline.comparison.differences import carried, differences

START_NS = 1_700_000_000_000_000_000


def samples(delay_s, first_ns=START_NS, n=2000, rate_hz=100.0, mode=0):
    """An estimate that is exact for the instant that it describes: v = sin(t − delay)."""
    t_s = np.arange(n) / rate_hz
    t_ns = first_ns + np.round(t_s * 1e9).astype(np.int64)
    at = (t_ns - START_NS) / 1e9 - delay_s
    columns = {"t_ns": t_ns, "t_s": t_s, "x_m": t_s, "y_m": np.zeros(n), "delay_s": delay_s}
    columns |= {name: np.sin(at) for name in ("v_long_mps", "yaw_rate_radps", "c_k_mps", "c_d_mps2")}
    columns |= {"alpha": 1.0 + 0 * t_s, "alpha_sd": 0.1, "mode": np.int8(mode), "mode_true": np.int8(0)}
    return pl.DataFrame(columns).with_columns(
        pl.lit("ok").alias("status"), pl.col("mode", "mode_true").cast(pl.Int8)
    )


def test_estimates_with_other_delays_are_compared_at_the_same_instant():
    """Row by row, two exact estimates with .1 and .4 s of delay would differ by up to .3."""
    a, b = samples(0.1), samples(0.4)
    found = differences(a, b)["v_long_mps"].to_numpy()
    assert np.nanmax(np.abs(found)) < 2e-5
    assert np.isfinite(found).mean() > 0.95
    assert np.isnan(found[-25:]).all()


def test_a_known_difference_is_found_with_its_sign():
    a, b = (
        samples(0.1),
        samples(0.1).with_columns(pl.col("c_k_mps") + 0.25, pl.col("x_m") + 3, pl.col("y_m") - 4),
    )
    found = differences(a, b)
    np.testing.assert_allclose(found["c_k_mps"], 0.25, atol=1e-12)
    np.testing.assert_allclose(found["position_m"], 5.0)


def test_nothing_is_carried_over_a_hole():
    t_s = np.array([0.0, 0.1, 0.2, 0.3, 1.3, 1.4])
    at_s = np.array([-0.1, 0.05, 0.3, 0.8, 1.35, 1.5])
    found = carried(t_s, 2 * t_s, at_s)
    np.testing.assert_allclose(found[[1, 2, 4]], 2 * at_s[[1, 2, 4]])
    assert np.isnan(found[[0, 3, 5]]).all()
    assert np.isnan(carried(t_s[:1], t_s[:1], at_s)).all()


def written(path, a, b, **options):
    other = a.select("t_ns", differs=pl.col("t_s").is_between(5, 8, closed="left"))
    write_comparison(path, Side("a", a, 100.0), Side("b", b, 100.0), other, "text", **options)
    tables = {}
    for chunk in RrdReader(path).stream():
        if not chunk.is_static:
            tables.setdefault(chunk.entity_path, []).append(pl.from_arrow(chunk.to_record_batch()))
    return {entity: pl.concat(parts).sort("log_t") for entity, parts in tables.items()}


def first_s(table):
    return table["log_t"].cast(pl.Int64)[0] / 1e9


def test_rows_of_one_log_lie_at_their_stamps(tmp_path):
    """b begins 3 s into the log: its rows begin at 3 s, not at zero."""
    a, b = samples(0.1), samples(0.1, START_NS + 3_000_000_000, n=1500)
    held = written(tmp_path / "a.rrd", a, b)
    assert (first_s(held["/mode/a"]), first_s(held["/mode/b"])) == (0.0, 3.0)
    difference = np.array(held["/difference/v_long_mps"]["Scalars:scalars"].to_list())[:, 0]
    np.testing.assert_allclose(difference[np.isfinite(difference)], 0.0, atol=1e-9)
    assert held["/mode/differs"]["StateChange:state"].to_list() == [
        ["same mode"],
        ["another mode"],
        ["same mode"],
    ]
    assert held["/mode/differs"]["log_t"].cast(pl.Int64).to_list() == [0, 5_000_000_000, 8_000_000_000]


def test_two_logs_are_laid_upon_one_another_by_the_time_since_their_starts(tmp_path):
    a, b = samples(0.1), samples(0.1, START_NS + 86_400_000_000_000)
    held = written(tmp_path / "a.rrd", a, b, by_stamp=False)
    assert (first_s(held["/mode/a"]), first_s(held["/mode/b"])) == (0.0, 0.0)
    assert len(held["/difference/position_m"]) == 2000
