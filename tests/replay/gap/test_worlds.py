"""The benchmark worlds' logs: the split, the cases of a run, and how the driver families drive."""

import importlib
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.replay.gap.bench_worlds import case_of

BENCH = Path(__file__).parents[3] / "bench"


def families_of_formulas() -> set[str]:
    """The drivers of all sets of forms; some are of these alone."""
    parts = tomllib.loads((BENCH / "formulas/split.toml").read_text(encoding="utf-8")).values()
    return {family for part in parts for cell in part["cells"] for family in cell["families"]}


def test_no_log_is_in_both_parts_of_the_split(worlds):
    develop, report = (worlds("split").part(name) for name in ("develop", "report"))
    assert not set(develop.cells) & set(report.cells)
    families = [{family for _, family in part.cells} for part in (develop, report)]
    assert set().union(*families) | families_of_formulas() == set(worlds("drivers").FAMILIES)
    assert not {family for _, family in develop.cells} & {family for _, family in report.cells}
    assert {plant for plant, _ in report.cells} >= {plant for plant, _ in develop.cells}
    assert develop.last_seed < report.first_seed
    with pytest.raises(ValueError, match="seed 3"):
        report.check(2, "yacht", 3)


def test_a_case_gives_one_log_and_noise_leaves_the_truth_alone(worlds):
    simulated = worlds("simulate").simulated
    for plant in (1, 2, 3):
        case = case_of(worlds, plant=plant)
        first, again, poor = simulated(case), simulated(case), simulated(replace(case, noise="poor"))
        assert np.array_equal(first.log.pose.x_m, again.log.pose.x_m)
        assert np.array_equal(first.truth.x_m, poor.truth.x_m)
        assert np.std(poor.log.pose.x_m - poor.truth.x_m) == pytest.approx(0.05, rel=0.15)


def test_cases_of_a_run_stay_in_their_part_and_mix_noise_and_effect(worlds):
    import argparse

    worlds("case")
    run = importlib.import_module("gap_worlds")
    every = {"effect": "all", "family": None, "plant": None, "noise": None}
    options = argparse.Namespace(split="report", n=864, first_seed=None, mixed=True, seconds=600.0, **every)
    cases = list(run.cases(options))
    assert len({case.seed for case in cases}) == 864
    assert {case.duration_s for case in cases} == {600.0}
    assert min(case.seed for case in cases) >= 5_900_000
    nothing = [case.noise for case in cases if not case.effect]
    assert len(nothing) == 288
    assert {nothing.count(noise) for noise in ("mocap", "rtk", "poor")} == {96}
    families = [case.family for case in cases if case.effect]
    assert min(families.count(family) for family in set(families)) >= 60
    assert {case.effect for case in cases} == {"", *worlds("plant_two.effects").EFFECTS}


def test_new_families_keep_to_a_robots_speeds(worlds):
    drivers = worlds("drivers")
    for family in ("delivery", "slalom", "lawn-mower", "joystick"):
        drive = drivers.drawn_drive(family, 90.0, np.random.default_rng(1))
        speed, turning = drive.path(np.arange(0.0, 90.0, 0.05))
        assert 0.4 < np.ptp(speed) < 3.0, family
        assert 0.3 < np.ptp(turning) < 2.8, family
        assert len(drive.modes.t_ns) > 3


def share(rows):
    return float(np.mean(rows))


@pytest.mark.parametrize("seed", range(8))
def test_late_families_drive_as_they_are_described(worlds, seed):
    """Bounds of speed, yaw rate and acceleration; who halts, who reverses, who does neither."""
    drawn, t_s = worlds("drivers").drawn_drive, np.arange(0.0, 90.0, 0.05)
    halts, back = {}, {}
    older = ("crowd", "figures", "shunting", "ladder", "mail", "polisher", "squares", "line")
    later = ("bump-and-turn", "forklift", "saws", "survey", "orchard", "ferry", "pacer", "rink")
    newest = ("plough", "museum", "skidpad", "search", "bed", "walker", "collector", "goalkeeper")
    outdoors = ("pram", "hound", "hairpins", "sprayer")
    practising = ("dance", "babble", "novice", "dolly")
    heeding = ("yacht", "sheepdog", "trailer", "waiter")
    for family in (*older, *later, *newest, *outdoors, *practising, *heeding):
        speed, turning = drawn(family, 90.0, np.random.default_rng(seed)).path(t_s)
        assert np.abs(speed).max() < 2.2, family
        assert np.abs(turning).max() < 1.3, family
        assert np.abs(np.diff(speed)).max() < 0.05 * 2.5, family
        halts[family], back[family] = share(np.abs(speed) < 0.02), share(speed < -0.02)
    assert 0.01 < halts["crowd"] < 0.2 < back["shunting"]
    assert halts["figures"] == back["figures"] == back["crowd"] == 0
    assert halts["shunting"] > 0.05 > halts["ladder"]
    assert halts["squares"] > 0 == halts["polisher"] == halts["line"]
    assert not any(back[family] for family in ("mail", "polisher", "squares", "line", "saws", "survey"))
    assert back["bump-and-turn"] > 0.02 < back["forklift"]
    assert halts["survey"] > 0.15 > halts["saws"] == 0
    assert not any(back[family] for family in ("pacer", "rink"))
    assert halts["pacer"] == 0
    assert back["ferry"] > 0.2 < halts["ferry"] + back["ferry"]
    assert back["orchard"] < 0.1
    assert back["plough"] > 0.05
    assert halts["plough"] > 0.03
    assert back["bed"] > 0.05 < halts["bed"]
    assert halts["collector"] > 0.01 < back["collector"] < 0.15
    assert halts["walker"] > 0.02 > back["walker"] == 0
    assert back["goalkeeper"] > 0.15 < halts["goalkeeper"]
    assert back["pram"] > 0.15
    assert back["hound"] == 0 < halts["hound"]
    assert halts["hairpins"] == back["hairpins"] == back["sprayer"] == 0
    assert halts["sprayer"] < 0.01  # sets out from rest
    assert all(back[family] > 0.05 < halts[family] for family in ("dance", "babble"))
    assert back["dolly"] > 0.1 < halts["dolly"]
    assert 0 < back["novice"] < 0.2  # rolls back where it has stopped too late
    assert halts["yacht"] == back["yacht"] == back["sheepdog"] == 0 < halts["sheepdog"]
    assert 0.03 < back["waiter"] < 0.15 < back["trailer"]
    assert halts["trailer"] > 0.03
    assert halts["waiter"] > 0.1
    assert back["museum"] == back["skidpad"] == 0 < halts["skidpad"] < halts["museum"]


def test_a_mail_round_mostly_coasts(worlds):
    """While it coasts its speed halves in a time that is drawn, and its path keeps one curvature."""
    speed, turning = (
        worlds("drivers").drawn_drive("mail", 90.0, np.random.default_rng(3)).path(np.arange(0.0, 90.0, 0.1))
    )
    decay_per_s = -np.diff(np.log(np.maximum(speed, 1e-3))) / 0.1
    steady = (speed[1:] > 0.1) & (np.abs(np.diff(decay_per_s, prepend=0.0)) < 1e-6)
    assert share(steady) > 0.4
    assert np.all((decay_per_s[steady] > 1 / 9.1) & (decay_per_s[steady] < 1 / 2.9))
    assert np.abs(turning).max() < 0.46 * speed.max()


def test_saws_have_one_rise_and_one_fall(worlds):
    """Speed has two accelerations; curvature two slopes by time, one the other's negative."""
    t_s = np.arange(0.0, 90.0, 0.1)
    for seed in range(4):
        speed, turning = worlds("drivers").drawn_drive("saws", 90.0, np.random.default_rng(seed)).path(t_s)
        for signal, most in ((speed, 0.9), (turning / speed, 0.32)):
            slopes, often = np.unique(np.round(np.diff(signal) / 0.1, 6), return_counts=True)
            two = slopes[np.argsort(often)[-2:]]
            assert share(np.isin(np.round(np.diff(signal) / 0.1, 6), two)) > 0.9
            assert two.prod() < 0 < np.abs(two).max() < most


def test_squares_close_and_orbits_go_round(worlds):
    """A square turns by whole turns between two changes of way; a polisher goes round 1.5 to 4 times."""
    t_s = np.arange(0.0, 90.0, 0.01)
    for family, fewest in (("squares", 0.75), ("polisher", 1.0)):
        _, turning = worlds("drivers").drawn_drive(family, 90.0, np.random.default_rng(4)).path(t_s)
        turns = np.cumsum(turning) * 0.01 / (2 * np.pi)
        changes = np.flatnonzero(np.diff(np.sign(turning[np.abs(turning) > 0.02])))
        at = np.flatnonzero(np.abs(turning) > 0.02)[changes]
        rounds = np.abs(np.diff(turns[at]))
        assert len(rounds) > 0, family
        assert fewest < rounds.min() <= rounds.max() < 4.5, family
