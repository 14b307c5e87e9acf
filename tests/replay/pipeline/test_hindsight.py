"""Hindsight: every row once, independent of batches, fixed lag, no answer where none may be given."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wmr_replay.pipeline.colour import FIRST_S
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.hindsight import SecondPass, record, spool
from wmr_replay.pipeline.memory import as_batch
from wmr_replay.pipeline.model_effects import ReplayModel
from wmr_replay.pipeline.settings import Settings
from wmr_replay.tables import hindsight_frame, samples_frame
from wmr_schemas import RobotParameters
from wmr_schemas.arrays import NS_PER_S
from wmr_schemas.status import WHOLE_LOG, Status
from wmr_synth import Sensors, synthesise

CLEAN = Sensors(rate_hz=50.0, torque_rate_hz=50.0, noise_xy_sd_m=0.01, noise_yaw_sd_rad=0.005)
ROUGH = replace(CLEAN, torque_rate_hz=20.0, jitter_s=0.004, dropout=0.05)
LAG = Settings(hindsight_lag_s=2.0)
CASES = {
    "bank": (CLEAN, LAG),
    "bank on rough stamps": (ROUGH, LAG),
    "bank with simultaneous modes": (CLEAN, replace(LAG, simultaneous=True)),
    "algebraic": (CLEAN, replace(LAG, identifier="algebraic")),
    "paper on rough stamps": (ROUGH, replace(LAG, identifier="paper")),
}
BANKS = [name for name in CASES if name.startswith("bank")]
cases = pytest.mark.parametrize("name", CASES)
P = ("p_ideal", "p_skidding", "p_slipping", "p_skidding_slipping")
MOTION = ("x_m", "y_m", "yaw_rad", "v_long_mps", "v_lat_mps", "yaw_rate_radps", "a_long_mps2")


class Both(SimpleNamespace):
    """``causal`` and ``later`` tables of a log, and the ``engine`` that made them."""


def both(batches, robot, asked=LAG) -> Both:
    """A log, given as batches, through the engine, then looked back upon."""
    engine = Engine(asked, ReplayModel(robot))
    columns = [c for batch in batches for c in engine.push(batch)] + engine.finish()
    later = [hindsight_frame(c) for c in engine.hindsight()]
    causal = pl.concat([samples_frame(c) for c in columns])
    return Both(causal=causal, later=pl.concat(later) if later else None, engine=engine)


def of_log(log, asked=LAG) -> Both:
    return both([as_batch(log)], log.robot, asked)


@pytest.fixture(scope="module")
def logs(log_rows):
    return {
        name: log_rows(synthesise("random", seed=24, duration_s=15, sensors=sensors).log)
        for name, (sensors, _) in CASES.items()
    }


@pytest.fixture(scope="module")
def wholes(logs):
    return {
        name: both([logs[name].batch(0, logs[name].n)], logs[name].robot, asked)
        for name, (_, asked) in CASES.items()
    }


@cases
def test_every_row_of_the_samples_table_once_and_in_order(wholes, name):
    causal, later = wholes[name].causal, wholes[name].later
    for column in ("t_ns", "t_s", "mode_true"):
        assert later[column].equals(causal[column]), column


@cases
@given(cuts=st.lists(st.integers(0, 1400), max_size=12))
@settings(max_examples=5, deadline=None)
def test_batches_change_no_bit(logs, wholes, name, cuts):
    edges = [0, *sorted(c for c in cuts if c < logs[name].n), logs[name].n]
    pieces = [logs[name].batch(a, b) for a, b in pairwise(edges)]
    assert both(pieces, logs[name].robot, CASES[name][1]).later.equals(wholes[name].later)


@cases
@pytest.mark.parametrize("n_rows", [7, 64])
def test_the_blocks_in_which_the_record_is_read_change_no_bit(wholes, name, n_rows, monkeypatch):
    monkeypatch.setattr(record.Spool.blocks, "__defaults__", (n_rows,))
    assert read_again(wholes[name]).equals(wholes[name].later)


def read_again(whole) -> pl.DataFrame:
    return pl.concat([hindsight_frame(c) for c in whole.engine.hindsight()])


def learned(whole):
    """What the first pass has learned on the whole log: a bank for the second, and the noise."""
    second = whole.engine._chain.second_pass()
    return second._looking_back, second._noise


@pytest.mark.parametrize("name", BANKS)
@given(data=st.data())
@settings(max_examples=5, deadline=None)
def test_with_the_parameters_given_a_row_depends_on_the_log_up_to_its_lag(logs, wholes, name, data):
    """Modes and probabilities up to the lag, motion up to the window, to the bit."""
    rows, asked, whole = logs[name], CASES[name][1], wholes[name]
    stamps = np.unique(rows.signals[0].t_ns)
    newest = data.draw(st.sampled_from(stamps[200:]))
    stop = sum(np.count_nonzero(signal.t_ns <= newest) for signal in rows.signals)
    part = both([rows.batch(0, stop)], rows.robot, asked)
    second = SecondPass(part.engine._record, *learned(whole), min_confidence=0.5, all_modes=asked.all_modes)
    told = pl.concat([hindsight_frame(c) for c in second.columns()])
    whole_told = whole.later.head(len(told))
    interval_s = 0.2
    for columns, reach_s in (
        ((*P, "mode", "mode_set", "alpha", "alpha_sd"), asked.hindsight_lag_s + 2 * interval_s),
        (MOTION, float(whole.causal["delay_s"].max()) + 0.001),
    ):
        known = told["t_ns"].to_numpy() <= newest - reach_s * NS_PER_S
        assert known.sum() > 20
        assert told.filter(known).select(columns).equals(whole_told.filter(known).select(columns))


@pytest.mark.parametrize("identifier", ["paper", "algebraic"])
def test_without_a_bank_the_mode_of_the_first_pass_moves_to_the_instant_that_it_describes(logs, identifier):
    rows = logs["algebraic"]
    found = both([rows.batch(0, rows.n)], rows.robot, replace(LAG, identifier=identifier))
    causal, later = found.causal, found.later
    full = np.flatnonzero(causal["delay_s"].is_not_null().to_numpy())
    delay_ns = np.rint(causal["delay_s"].to_numpy()[full] * NS_PER_S).astype(np.int64)
    about = np.maximum.accumulate(causal["t_ns"].to_numpy()[full] - delay_ns)
    at = np.searchsorted(about, later["t_ns"].to_numpy())
    inside = (later["t_ns"].to_numpy() >= about[0]) & (at < len(about))
    assert inside.mean() > 0.9
    expected = causal["mode"].to_numpy()[full[at[inside]]]
    assert (later["mode"].to_numpy()[inside] == expected).all()
    assert all(later[p].null_count() == len(later) for p in P)


@cases
def test_motion_is_the_first_passs_at_the_instant_that_it_describes(wholes, name):
    causal, later = wholes[name].causal, wholes[name].later
    known = causal.drop_nulls("v_long_mps")
    about_s = (known["t_s"] - known["delay_s"]).to_numpy()
    told = later.drop_nulls("v_long_mps")
    assert len(told) > 0.9 * len(later)
    told = told.filter(pl.col("t_s") >= about_s[0])
    for column in ("v_long_mps", "yaw_rate_radps"):
        expected = np.interp(told["t_s"].to_numpy(), about_s, known[column].to_numpy())
        np.testing.assert_allclose(told[column].to_numpy(), expected, rtol=0, atol=1e-7)


@cases
def test_intervals_are_the_first_passs_until_the_noise_is_known_and_never_narrower(wholes, name):
    """From then on the noise is that of the rows after, too."""
    causal, later = wholes[name].causal, wholes[name].later
    known = causal.drop_nulls("v_long_mps")
    about_s = (known["t_s"] - known["delay_s"]).to_numpy()
    told = later.drop_nulls("v_long_mps").filter(pl.col("t_s") >= about_s[0])
    first = (told["t_s"] < FIRST_S - float(causal["delay_s"].max())).to_numpy()
    assert first.any()
    for column in ("v_long_mps_sd", "yaw_rate_radps_sd"):
        causal_sd = np.interp(told["t_s"].to_numpy(), about_s, known[column].to_numpy())
        np.testing.assert_allclose(told[column].to_numpy()[first], causal_sd[first], rtol=0, atol=1e-7)
        assert (told[column].to_numpy() >= causal_sd - 1e-7).all()


def test_the_first_window_is_told_from_its_middle_on(wholes):
    """No second delay at the log's beginning: the first described instant is one delay after the start."""
    causal, later = wholes["bank"].causal, wholes["bank"].later
    first = causal.drop_nulls("delay_s").row(0, named=True)
    begins_s = later.drop_nulls("v_long_mps")["t_s"][0]
    assert begins_s <= first["t_s"] - first["delay_s"] + 0.021


@cases
def test_rows_mean_what_the_documentation_says(wholes, name):
    later, simultaneous = wholes[name].later, "simultaneous" in name
    posterior = later.select(P).drop_nulls("p_ideal").fill_null(0.0).to_numpy()
    assert len(posterior) == (len(later) if name in BANKS else 0)
    np.testing.assert_allclose(posterior.sum(axis=1), 1.0, atol=1e-9)
    if name in BANKS:
        assert (later["p_skidding_slipping"].null_count() == 0) == simultaneous
        assert (later["alpha_sd"] > 0).all()
    named = later.filter(pl.col("mode") >= 0)
    assert ((named["mode_set"].to_numpy() >> named["mode"].to_numpy()) & 1 == 1).all()
    assert (named["status"] == "ok").all()
    assert (later.filter(pl.col("mode") < 0)["status"] != "ok").all()


def test_the_same_blocks_come_from_memory_and_from_the_temporary_file(monkeypatch):
    rng = np.random.default_rng(0)
    rows = np.zeros(5000, record.ROW)
    rows["t_ns"], rows["described"] = np.arange(5000), rng.normal(size=(5000, rows["described"].shape[1]))

    def blocks_of(most_bytes):
        monkeypatch.setattr(spool, "MOST_BYTES", most_bytes)
        kept = spool.Spool(record.ROW)
        for part in np.split(rows, [0, 1, 999, 4000]):
            kept.push(part)
        assert kept._file._rolled == (most_bytes == 1)
        return [block.tobytes() for block in kept.blocks(700)]

    from_memory = blocks_of(1 << 30)
    assert from_memory == blocks_of(1)
    assert b"".join(from_memory) == rows.tobytes()
    assert len(from_memory) == 8


def test_a_long_record_in_the_temporary_file_gives_the_same_table(logs, wholes, monkeypatch):
    monkeypatch.setattr(spool, "MOST_BYTES", 1000)
    rows = logs["bank"]
    assert both([rows.batch(0, rows.n)], rows.robot).later.equals(wholes["bank"].later)


def test_hindsight_can_be_asked_for_twice(wholes):
    assert read_again(wholes["bank"]).equals(wholes["bank"].later)


def with_pose(log, **columns):
    return replace(log, pose=replace(log.pose, **columns))


def test_outliers_are_rows_like_any_other_in_hindsight(wholes):
    log = synthesise("random", seed=24, duration_s=15, sensors=CLEAN).log
    hit = np.arange(150, len(log.pose.t_ns) - 60, 97)
    x_m = log.pose.x_m.copy()
    x_m[hit] += 30.0
    found = of_log(with_pose(log, x_m=x_m))
    outlier = (found.causal["status"] == "outlier").to_numpy()
    assert outlier[hit].all()
    later = found.later.filter(outlier)
    assert later.select("v_long_mps", "p_ideal").null_count().row(0) == (0, 0)
    assert (later["status"] != "outlier").any()
    plain = wholes["bank"].later
    apart = (found.later["v_long_mps"] - plain["v_long_mps"]).abs().max()
    assert apart < 0.5
    assert (found.later["mode"] == plain["mode"]).mean() > 0.95


def test_across_a_hole_no_motion_is_told_and_none_is_lost_behind_it():
    log = synthesise("random", seed=24, duration_s=15, sensors=CLEAN).log
    t_s = (log.pose.t_ns - log.pose.t_ns[0]) / 1e9
    keep = (t_s < 6.0) | (t_s > 8.5)
    pose = type(log.pose)(*(getattr(log.pose, name)[keep] for name in vars(log.pose)))
    found = of_log(replace(log, pose=pose))
    assert found.later["t_ns"].equals(found.causal["t_ns"])
    delay_s = float(found.causal["delay_s"].max())
    near = found.later.filter(pl.col("t_s").is_between(6.0 - delay_s / 2, 8.5 + delay_s / 2))
    assert near["v_long_mps"].null_count() == len(near)
    behind = found.later.filter(pl.col("t_s").is_between(8.5 + 1.1 * delay_s, 14.0))
    assert behind["v_long_mps"].null_count() == 0
    silent = found.later["p_ideal"].is_null()
    assert set(found.later.filter(silent)["status"]) <= {"gap"}
    assert set(found.causal.filter(silent)["status"]) <= {"gap"}
    assert silent.mean() < 0.05


def test_a_jump_of_the_pose_leaves_the_smoothed_path_in_one_piece():
    log = synthesise("random", seed=24, duration_s=15, sensors=CLEAN).log
    x_m = log.pose.x_m + np.where(np.arange(len(log.pose.t_ns)) > 400, 50.0, 0.0)
    found = of_log(with_pose(log, x_m=x_m))
    assert (found.causal["status"] == "pose_jump").any()
    told = found.later.drop_nulls("x_m")
    step_m = np.hypot(np.diff(told["x_m"].to_numpy()), np.diff(told["y_m"].to_numpy()))
    v_long = told["v_long_mps"].to_numpy()
    assert step_m.max() < 2.0 * np.abs(v_long).max()
    assert np.abs(v_long).max() < 10.0
    assert not (found.later["status"] == "pose_jump").all()


@pytest.mark.parametrize("stop", [0, 1, 30, 90, 120, 160])
def test_a_log_too_short_has_every_row_or_no_table_at_all(logs, stop):
    """30 messages end within the initial stretch, 120 before the bank has started."""
    rows = logs["bank"]
    engine = Engine(LAG, ReplayModel(rows.robot))
    causal = [*engine.push(rows.batch(0, stop)), *engine.finish()]
    later = list(engine.hindsight())
    n = sum(len(c["t_ns"]) for c in later)
    assert n in (0, sum(len(c["t_ns"]) for c in causal))
    assert bool(n) == (stop > 110)


def test_a_robot_without_a_nominal_alpha_has_hindsight_from_the_first_row_on(logs):
    rows = logs["bank"]
    found = both([rows.batch(0, rows.n)], RobotParameters(half_track_m=1.0))
    assert found.causal["p_ideal"].null_count() > 50
    assert found.later["p_ideal"].null_count() == 0


BARRED = sorted(WHOLE_LOG)


def recorded(status):
    """A record of the columns that a chain writes: 200 rows with ``status`` (200,)."""
    kept = record.Record()
    n = len(status)
    estimates = {name: np.zeros(n) for name in (*record.SMOOTHED_POSE, *record.Motion._fields)}
    estimates |= {"delay_s": np.full(n, 0.1), "mode": np.zeros(n, np.int8), "status": status}
    estimates |= {"mode_set": np.ones(n, np.uint8)}
    t_ns = np.arange(n) * 10_000_000

    class Stamped(SimpleNamespace):
        def __len__(self):
            return n

    kept.push_rows(Stamped(t_ns=t_ns, mode_true=np.zeros(n, np.int8)), estimates)
    return kept


@pytest.mark.parametrize("fault", BARRED)
@pytest.mark.parametrize("last", [None, Status.OUTLIER, Status.GAP, Status.POSE_JUMP])
def test_a_fault_of_the_whole_log_bars_from_the_first_row_on_whatever_the_last_row_is(fault, last):
    status = np.full(200, Status.OK, np.int8)
    status[120:] = fault
    if last is not None:
        status[-3:] = last
    second = SecondPass(recorded(status), None, min_confidence=0.5, all_modes=Settings().all_modes)
    told = pl.concat([hindsight_frame(c) for c in second.columns()])
    assert set(told["status"]) == {fault.label}
    assert (told["mode"] == -1).all()
    assert (told["mode_set"] == int(Settings().all_modes)).all()
    assert told["p_ideal"].null_count() == told["alpha"].null_count() == len(told)


def test_a_fault_that_passed_bars_its_own_rows_alone():
    status = np.full(200, Status.OK, np.int8)
    status[50:80] = Status.RATE_TOO_LOW
    second = SecondPass(recorded(status), None, min_confidence=0.5, all_modes=Settings().all_modes)
    told = pl.concat([hindsight_frame(c) for c in second.columns()])
    assert (told["status"] == "rate_too_low").to_numpy().nonzero()[0].tolist() == list(range(50, 80))


def dead_reckoned(log):
    """The log with a pose integrated from its own wheel speeds."""
    t = log.pose.t_ns
    held = np.searchsorted(log.torque.t_ns, t, side="right") - 1
    left, right = (np.where(held < 0, 0.0, w[held]) for w in (log.torque.left_radps, log.torque.right_radps))
    r, half = log.robot.wheel_radius_m, log.robot.half_track_m
    dt = np.diff(t, prepend=t[0]) * 1e-9
    v, omega = r * (left + right) / 2, r * (right - left) / (2 * half)
    yaw = np.cumsum(omega * dt)
    return with_pose(
        log, x_m=np.cumsum(v * np.cos(yaw) * dt), y_m=np.cumsum(v * np.sin(yaw) * dt), yaw_rad=yaw
    )


def test_a_pose_from_wheel_speeds_has_no_mode_in_hindsight_from_the_first_row_on():
    log = dead_reckoned(synthesise("random", seed=24, duration_s=20, sensors=CLEAN).log)
    found = of_log(log)
    assert found.causal["status"][-1] == "pose_not_independent"
    assert found.causal["status"][0] != "pose_not_independent"
    assert set(found.later["status"]) == {"pose_not_independent"}
    assert (found.later["mode"] == -1).all()


FAMILIES = [
    ("random", seed, Sensors(100.0, 100.0, *noise))
    for seed, noise in ((30, (0.001, 0.002)), (31, (0.01, 0.005)), (32, (0.05, 0.02)), (33, (0.03, 0.01)))
]


@pytest.fixture(scope="module")
def judged():
    made = [synthesise(name, seed=seed, duration_s=60, sensors=sensors) for name, seed, sensors in FAMILIES]
    return [(simulated, of_log(simulated.log, Settings())) for simulated in made]


def test_hindsight_names_more_modes_right_than_the_causal_answer(judged):
    right = {
        name: np.array([
            (table["mode"] == table["mode_true"]).to_numpy()[100:].mean()
            for table in (getattr(found, name) for _, found in judged)
        ])
        for name in ("causal", "later")
    }  # fmt: skip
    assert (right["later"] > right["causal"] - 0.002).all()
    assert right["later"].mean() > right["causal"].mean() + 0.02


def test_true_velocities_lie_within_the_95_percent_intervals(judged):
    """The intervals are those of the noise: where a mode switches within a window, the window's bias comes on
    top. v_lat and the yaw rate hold .88 and more, v_long .80 (docs/hindsight.md).
    """
    least = {"v_long_mps": 0.80, "v_lat_mps": 0.88, "yaw_rate_radps": 0.88}
    for simulated, found in judged:
        told = found.later.drop_nulls("v_long_mps")
        at = np.searchsorted(simulated.log.pose.t_ns, told["t_ns"].to_numpy())
        for column, share in least.items():
            off = told[column].to_numpy() - getattr(simulated.truth, column)[at]
            inside = np.abs(off) <= 1.96 * told[f"{column}_sd"].to_numpy()
            assert share <= inside.mean() <= 0.995, column
