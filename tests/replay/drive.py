"""A made-up drive in the shape of the samples table, for tests that need no identifier."""

import numpy as np
import polars as pl

from wmr_schemas.tables import SAMPLES, polars_schema

DELAY_S = 0.4
START_NS = 1_700_000_000_000_000_000
ALPHA = 0.0255
SWITCHES_S = (0.0, 12.0, 22.0, 34.0, 44.0, 52.0)
TRUE_MODES = (0, 1, 2, 1, 0, 3)


def true_state(rate_hz: float, duration_s: float = 60.0) -> pl.DataFrame:
    """The side file's columns: a wide slalom with lateral velocity while skidding."""
    t = np.arange(round(rate_hz * duration_s)) / rate_hz
    mode = np.array(TRUE_MODES, np.int8)[np.searchsorted(SWITCHES_S, t, side="right") - 1]
    v_long = 3 + 2 * np.sin(t / 9)
    yaw_rate = 0.35 * np.cos(t / 5)
    yaw = np.cumsum(yaw_rate) / rate_hz
    v_lat = np.where(mode % 2 == 1, -0.8 * np.sin(t / 2), 0.0)
    x = np.cumsum(v_long * np.cos(yaw) - v_lat * np.sin(yaw)) / rate_hz
    y = np.cumsum(v_long * np.sin(yaw) + v_lat * np.cos(yaw)) / rate_hz
    return pl.DataFrame(
        {
            "t_ns": START_NS + np.round(t * 1e9).astype(np.int64),
            "t_s": t,
            "x_m": x,
            "y_m": y,
            "yaw_rad": yaw,
            "v_long_mps": v_long,
            "v_lat_mps": v_lat,
            "yaw_rate_radps": yaw_rate,
            "mode": mode,
        }
    )


def samples(
    rate_hz: float, duration_s: float = 60.0, with_torque: bool = True, seed: int = 0
) -> pl.DataFrame:
    """What an identifier with a delay of ``DELAY_S`` would make of the drive; nothing known during its first window."""
    truth, random = true_state(rate_hz, duration_s), np.random.default_rng(seed)
    n, late = len(truth), round(DELAY_S * rate_hz)
    described = np.maximum(np.arange(n) - late, 0)
    warming = np.arange(n) < 2 * late

    def known(values: np.ndarray) -> np.ndarray:
        return np.where(warming, np.nan, values)

    def estimate(column: str, sd: float) -> np.ndarray:
        return known(truth[column].to_numpy()[described] + sd * random.standard_normal(n))

    v_lat = estimate("v_lat_mps", 0.04)
    true_mode = truth["mode"].to_numpy()
    late_mode = true_mode[described]
    slip = np.isin(late_mode, (2, 3)) * 0.9
    alpha_sd = 0.02 / np.sqrt(1 + np.arange(n) / rate_hz)
    torque = float("nan") if not with_torque else 1.0
    columns = {
        "t_ns": truth["t_ns"],
        "t_s": truth["t_s"],
        "x_m": truth["x_m"] + 0.05 * random.standard_normal(n),
        "y_m": truth["y_m"] + 0.05 * random.standard_normal(n),
        "yaw_rad": truth["yaw_rad"] + 0.01 * random.standard_normal(n),
        "v_long_mps": estimate("v_long_mps", 0.05),
        "v_lat_mps": v_lat,
        "yaw_rate_radps": estimate("yaw_rate_radps", 0.02),
        "delay_s": np.full(n, DELAY_S),
        "c_k_mps": -v_lat,
        "c_k_threshold_mps": known(np.full(n, 0.16)),
        "c_d_mps2": known(slip + 0.08 * random.standard_normal(n)) * torque,
        "c_d_threshold_mps2": known(np.full(n, 0.3)) * torque,
        "mode": np.where(warming, -1, late_mode).astype(np.int8),
        "alpha": known(ALPHA * (1 + 0.3 * np.exp(-np.arange(n) / (5 * rate_hz)))) * torque,
        "alpha_sd": known(0.2 * alpha_sd) * torque,
        "status": np.where(warming, "warming_up", "ok" if with_torque else "no_torque"),
        "mode_true": true_mode,
    }
    schema = polars_schema(SAMPLES)
    table = pl.DataFrame(columns).with_columns(pl.col(pl.Float64).fill_nan(None))
    missing = [pl.lit(None, dtype).alias(name) for name, dtype in schema.items() if name not in columns]
    return table.with_columns(missing).select(pl.col(name).cast(dtype) for name, dtype in schema.items())
