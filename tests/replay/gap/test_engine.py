"""Logs of a contact engine: the committed split and names, the engine's mechanisms, and what they taught.

Tyres that creep do not skid, and a rest that the calibration log shows is no finding.
"""

import importlib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from wmr_replay.gap import GapOptions, analyse, calibrate
from wmr_replay.gap.estimation.likely_modes import likely_modes
from wmr_replay.gap.estimation.modes import identified_modes
from wmr_replay.gap.model.base import base_of
from wmr_replay.gap.model.extension import Extension
from wmr_replay.gap.scan.misfit import floor_of, is_rest, surely_left, turning_is_unknown
from wmr_replay.gap.search.select import shows_rest
from wmr_replay.gap.settings.scan import MisfitSettings
from wmr_schemas.effects import effects_of
from wmr_schemas.modes import ContactMode

mujoco = pytest.importorskip("mujoco")
BENCH = Path(__file__).parents[3] / "bench"
OWN = MisfitSettings()


@pytest.fixture(scope="module")
def nothing_hidden(engine):
    """Two logs of the courier with nothing hidden, from a precise pose."""
    case = engine("case").Case("courier", "stop-go", "mocap", "", 11, 45.0)
    return [engine("logs").logged(replace(case, seed=seed)) for seed in (11, 12)]


@pytest.fixture(scope="module")
def calibrated(nothing_hidden):
    log = nothing_hidden[0].log
    return calibrate(log, log.robot)


def test_robots_are_held_out_and_seeds_do_not_meet(engine):
    develop, report = (engine("split").part(name) for name in ("develop", "report"))
    assert set(report.robots) - set(develop.robots) == {"bellhop", "stevedore"}
    assert develop.last_seed < report.first_seed
    assert set(develop.families) | set(report.families) == set(engine("case").FAMILIES)
    with pytest.raises(ValueError, match="seed 5 is not"):
        report.check(5)


@pytest.mark.parametrize(
    ("robot", "base"),
    [("courier", "torque"), ("rover", "wheel_speed"), ("courier-wheels", "wheel_speed")],
)
def test_at_most_two_names_are_accepted_for_an_effect(engine, robot, base):
    accepted, known = engine("split").accepted(robot), effects_of(base)
    assert set(accepted) <= set(engine("effects").EDITS)
    for names in accepted.values():
        assert 1 <= len(names) <= 2
        assert set(names) <= set(known)


def test_a_robot_with_small_wheels_drives_at_its_own_pace(engine):
    case, t_s = engine("case").Case("courier", "wander", "mocap", "", 17), np.arange(0.0, 90.0, 0.1)
    full, slow = (np.stack(one.references()(t_s)) for one in (case, replace(case, robot="beetle")))
    assert np.array_equal(slow, np.array([[0.5], [1.0]]) * full)


def test_outcomes(engine):
    outcome = engine("score").outcome

    def row(verdict, *names, near=()):
        alternatives = dict.fromkeys(near, 3.0)
        return {
            "verdict": verdict,
            "effects": [{"name": name, "class": [name], "alternatives": alternatives} for name in names],
        }

    accepted = ["wheel_coulomb", "rolling_resistance"]
    assert outcome(row("named", "wheel_coulomb"), accepted) == "right"
    assert outcome(row("named", "wheel_coulomb", "slope"), accepted) == "more"
    assert outcome(row("ambiguous", "viscous_drag", near=["rolling_resistance"]), accepted) == "among"
    assert outcome(row("named", "slope"), accepted) == "wrong"
    assert outcome(row("not_enough_excitation"), accepted) == "refused"
    assert outcome(row("nothing_missing"), []) == "silent"
    assert outcome(row("named", "slope"), []) == "false"
    assert outcome({"error": "ValueError"}, accepted) == "error"
    shared = row("named", "icr_offset", "effective_track")
    assert outcome(shared, ["icr_offset", "effective_track"], both=True) == "right"
    assert outcome(shared, ["icr_offset", "effective_track"]) == "more"
    assert (
        outcome(row("named", "icr_offset", "slope"), ["icr_offset", "effective_track"], both=True) == "more"
    )


def test_the_bases_of_a_state_are_made_once(engine, tmp_path, monkeypatch, calibrated):
    bases, made = engine("bases"), []
    monkeypatch.setattr(bases, "KEPT", tmp_path)
    case = engine("case").Case("courier", "stop-go", "mocap", "", 1)

    def make():
        made.append(1)
        return calibrated

    first, second = (bases.kept((case,), make) for _ in range(2))
    assert len(made) == 1
    assert first.robot.alpha == second.robot.alpha == pytest.approx(calibrated.robot.alpha)
    assert second.misfit == pytest.approx(dict(calibrated.misfit))
    bases.kept((replace(case, seed=2),), make)
    assert len(made) == 2


def test_a_robot_may_record_its_wheels_alone(engine):
    """The same drive; the base of wheel speeds, from one calibration log, and the names that it has."""
    logs, case = engine("logs"), engine("case").Case("courier", "wander", "mocap", "", 3, 10.0)
    torques, wheels = (logs.logged(replace(case, robot=name)) for name in ("courier", "courier-wheels"))
    assert np.array_equal(torques.motion.left_radps, wheels.motion.left_radps)
    assert (torques.log.wheels, wheels.log.torque) == (None, None)
    assert len(wheels.log.wheels) == len(torques.log.torque)
    assert len(logs.calibration_cases(wheels_case := replace(case, robot="courier-wheels"))) == 1
    assert logs.calibration_cases(wheels_case)[0].robot == "courier-wheels"
    effects = [*engine("split").accepted("courier-wheels")]
    assert "track" in effects
    assert "payload" not in effects
    assert not any(engine("split").makes_both("courier-wheels", one) for one in effects)


def test_with_wheel_speeds_the_skid_steered_robot_is_left_out(engine, monkeypatch):
    monkeypatch.syspath_prepend(str(BENCH))
    campaign = importlib.import_module("gap_mujoco")
    options = dict.fromkeys(("robot", "family", "noise", "first_seed"))
    report = engine("split").part("report")
    cases = campaign.cases(
        SimpleNamespace(**options, split="report", kind="all", effect="all", n=40, wheel_speeds=True)
    )
    assert {case.robot for case in cases} == {f"{name}-wheels" for name in report.robots if name != "rover"}


def test_a_run_of_the_engine_may_be_stopped_anywhere(engine, monkeypatch):
    monkeypatch.syspath_prepend(str(BENCH))
    campaign = importlib.import_module("gap_mujoco")
    options = {
        "split": "report",
        "robot": None,
        "family": None,
        "noise": None,
        "first_seed": None,
        "kind": "all",
        "wheel_speeds": False,
    }
    cases = list(campaign.cases(SimpleNamespace(**options, effect="all", n=545)))
    assert [case.seed for case in cases] == list(range(8_500_000, 8_500_545))
    hiding = [case for case in cases if case.effect]
    assert len(hiding) == 222
    for chosen in (cases, hiding, [case for case in cases if not case.effect]):
        for key in ("robot", "noise", "family"):
            counts = [
                [getattr(one, key) for one in chosen].count(v) for v in {getattr(c, key) for c in chosen}
            ]
            assert max(counts) <= 1.4 * min(counts)


def test_tyres_that_creep_do_not_skid(nothing_hidden, calibrated):
    log = replace(nothing_hidden[1].log, robot=calibrated.robot)
    extension, gates = Extension(base_of(calibrated.robot)), GapOptions().gates
    t_ns = log.pose.t_ns
    shares = []
    for modes in (identified_modes, likely_modes):
        track = modes(log, extension, gates)
        at = track.mode[np.searchsorted(track.t_ns, t_ns, side="right").clip(1) - 1]
        shares.append(np.mean(at == ContactMode.SKIDDING))
    assert np.abs(nothing_hidden[1].motion.v_lat_mps).max() < 0.01
    assert max(shares) < 0.02


def test_a_rest_of_the_calibration_log_is_no_finding(nothing_hidden, calibrated):
    log, rolling = nothing_hidden[1].log, GapOptions(modes="ideal")
    without = analyse(log, replace(calibrated, effects=(), misfit={}), rolling)
    assert without.verdict != "nothing_missing"
    found = analyse(log, calibrated, rolling)
    assert (found.verdict, found.effects) == ("nothing_missing", ())
    assert found.model.misfit == calibrated.misfit


def test_what_the_base_model_leaves_is_a_rest_of_any_size(calibrated):
    extension = replace(Extension(base_of(calibrated.robot)), misfit={"viscous_drag": 1.0, "slope": 0.026})
    assert floor_of("viscous_drag", extension, OWN) == 1.0
    assert floor_of("slope", extension, OWN) == 0.026
    known = {"viscous_drag": 0.01, "rolling_resistance": 0.028, "scrub_torque": 0.01, "yaw_damping": 0.08}
    extension = replace(extension, misfit=extension.misfit | known)
    assert floor_of("rolling_resistance", extension, OWN) == 0.028
    assert floor_of("scrub_torque", extension, OWN) == pytest.approx(OWN.least_share * 0.03)
    assert floor_of("yaw_damping", extension, OWN) == pytest.approx(OWN.other_drives * 0.08)
    assert floor_of("heading_misalignment", extension, OWN) == pytest.approx(OWN.least_share * 0.2 * 0.05)
    assert floor_of("load_step", extension, OWN) == floor_of("torque_saturation", extension, OWN) == 0.0
    assert floor_of("rolling_resistance", replace(extension, misfit={}), OWN) == 0.0
    for grade, rest in ((0.017, True), (0.02, False)):  # of both components together, .024 and .028
        slope = extension.with_effect("slope", {"grade_x_mps2": grade, "grade_y_mps2": grade})
        assert is_rest("slope", slope, OWN) is rest


@pytest.mark.parametrize(("left", "floor"), [(0.3, 0.6), (0.04, 0.08), (0.001, 0.064)])
def test_an_alpha_yaw_in_doubt_is_off_by_another_factor_on_another_drive(calibrated, left, floor):
    """Twice what the calibration leaves, and no less than four fifths of what is negligible, .08."""
    extension = replace(Extension(base_of(calibrated.robot)), misfit={"yaw_inertia": left})
    assert floor_of("yaw_inertia", extension, OWN) == pytest.approx(floor)
    assert is_rest("yaw_inertia", extension.with_effect("yaw_inertia", {"ratio": 0.99 * floor}), OWN)
    assert not is_rest("yaw_inertia", extension.with_effect("yaw_inertia", {"ratio": 1.01 * floor}), OWN)


def test_an_effect_must_surely_exceed_what_other_drives_leave(calibrated):
    misfit = {"viscous_drag": 0.003, "scrub_torque": 0.02, "heading_misalignment": 0.001}
    extension = replace(Extension(base_of(calibrated.robot)), misfit=misfit)
    assert surely_left("viscous_drag", extension, OWN) == OWN.other_drives * 0.003
    assert surely_left("scrub_torque", extension, OWN) == floor_of("scrub_torque", extension, OWN) < 0.04
    assert surely_left("heading_misalignment", extension, OWN) == OWN.other_drives * 0.001
    assert surely_left("input_delay", extension, OWN) == floor_of("input_delay", extension, OWN) > 0
    assert surely_left("viscous_drag", replace(extension, misfit={}), OWN) == 0.0


@pytest.mark.parametrize(("open_to", "unknown"), [(0.079, False), (0.081, True)])
def test_where_something_else_turns_the_robot_an_effect_is_surely_more_than_negligible(
    calibrated, open_to, unknown
):
    """α_yaw known to 8 % is known: less of a yaw inertia is negligible. Else a drag of .04 1/s and a payload
    of .06 are, a scrub half as much again, and of a yaw damping up to six times what the calibration left and
    of a yaw inertia two and a half times.
    """
    misfit = {"viscous_drag": 0.003, "payload": 0.01, "yaw_damping": 0.1, "heading_misalignment": 0.001}
    misfit |= {"scrub_torque": 0.005, "yaw_inertia": open_to}
    extension = replace(Extension(base_of(calibrated.robot)), misfit=misfit)
    least = {name: surely_left(name, extension, OWN) for name in extension.misfit}
    assert turning_is_unknown(extension.misfit, OWN) is unknown
    assert least["viscous_drag"] == pytest.approx(0.04 if unknown else 0.006)
    assert least["payload"] == pytest.approx(0.06 if unknown else 0.02)
    assert least["scrub_torque"] == pytest.approx(0.045 if unknown else 0.01)
    assert least["yaw_damping"] == pytest.approx(0.6 if unknown else 0.2)
    assert least["yaw_inertia"] == pytest.approx(OWN.unknown_inertia * open_to if unknown else open_to)
    assert least["heading_misalignment"] == pytest.approx(0.002)
    assert surely_left("load_step", extension, OWN) == 0.0


def test_beside_an_effect_that_matters_everything_negligible_is_a_rest(calibrated):
    """Up to one and a half times that, where a calibration measures it; not beside one that the base model
    has.
    """
    misfit = {"viscous_drag": 0.01, "yaw_damping": 0.001}
    extension = replace(Extension(base_of(calibrated.robot)), misfit=misfit)
    for drag, least in ((0.03, OWN.least_share * 0.12), (0.1, OWN.beside * 0.12)):
        beside = extension.with_effect("viscous_drag", {"c1_per_s": drag})
        assert floor_of("input_delay", beside, OWN) == (0.03 if drag > 0.05 else OWN.least_share * 0.03)
        assert floor_of("yaw_damping", beside, OWN) == pytest.approx(least)
        known = replace(extension, known=(("viscous_drag", {"c1_per_s": drag}),))
        assert floor_of("yaw_damping", known, OWN) == pytest.approx(OWN.least_share * 0.12)


def test_a_base_model_holds_the_rests_that_its_log_proves(calibrated):
    """Casters and tyres of the engine brake as a viscous friction of the wheels does, all in all; in turns
    they are a centre of mass 1 mm off the axle.
    """
    rests = {effect.name: effect.parameters for effect in calibrated.effects}
    assert abs(rests.pop("com_offset")["offset_m"]) == pytest.approx(0.001, abs=0.0005)
    assert abs(rests.pop("torque_imbalance", {"ratio": 0.0})["ratio"]) < 0.002
    assert [*rests] in (["wheel_viscous"], ["viscous_drag"])
    sd = calibrated.robot_sd["alpha"] / calibrated.robot.alpha
    load, least = calibrated.misfit["payload"], OWN.in_sd * sd
    assert load == calibrated.misfit["drive_gain"]
    assert least < load < least + 0.01, "torques that ask for far more than a disturbance"


def rest(extension, p_value=1e-9, score=100.0):
    """A fitted lever arm of 3 mm, which a creeping tyre looks like."""
    arm = extension.with_effect("pose_lever_arm", {"x_m": -0.003, "y_m": 0.0})
    return SimpleNamespace(
        name="pose_lever_arm", fit=SimpleNamespace(extension=arm), p_value=p_value, score=score
    )


def test_a_rest_that_explains_most_is_held_and_the_search_goes_on(calibrated):
    problem = SimpleNamespace(settings=GapOptions().gates)
    bare = Extension(base_of(calibrated.robot))
    extension = replace(bare, misfit=calibrated.misfit)
    current = SimpleNamespace(extension=extension)
    assert shows_rest(problem, extension, current, (rest(extension),))
    assert not shows_rest(problem, extension, current, ())
    assert not shows_rest(problem, extension, current, (rest(extension, p_value=0.1),))
    assert not shows_rest(problem, extension, current, (rest(extension, score=-1.0),))
    assert not shows_rest(problem, bare, SimpleNamespace(extension=bare), (rest(bare),))
    held = (("pose_lever_arm", {"x_m": 0.001, "y_m": 0.0}),) * OWN.most_rests
    full = SimpleNamespace(extension=replace(extension, known=held))
    assert not shows_rest(problem, extension, full, (rest(extension),))


def test_another_log_of_a_robot_has_the_same_hidden_size_on_another_drive(engine):
    case = engine("case").Case("courier", "wander", "mocap", "payload", 17)
    again = replace(case, again=True)
    draws = [
        [one.stream(purpose).uniform() for purpose in ("size", "drive", "pose")] for one in (case, again)
    ]
    assert draws[0][0] == draws[1][0]
    assert draws[0][1] != draws[1][1]
    assert draws[0][2] != draws[1][2]


def test_bases_are_calibrated_without_the_effect_on_other_seeds(engine):
    logs, case = engine("logs"), engine("case").Case("rover", "wander", "rtk", "track", 17, again=True)
    drives = logs.calibration_cases(case)
    assert [one.family for one in drives] == ["stop-go", "wander"]
    assert {(one.effect, one.noise, one.again) for one in drives} == {("", "rtk", False)}
    assert len({one.seed for one in drives} | {case.seed}) == 3
    assert len(logs.calibration_cases(replace(case, robot="cart"))) == 1


def test_what_a_calibration_log_shows_is_held_however_large(engine):
    case = engine("case").Case("courier", "stop-go", "mocap", "joint_damping", 13, 45.0)
    braked = engine("logs").logged(case)
    assert braked.hidden.sizes["c1_per_s"] > OWN.negligible_per_s
    held = {effect.name: effect.parameters for effect in calibrate(braked.log, braked.log.robot).effects}
    assert held["wheel_viscous"]["nm_per_radps"] == pytest.approx(
        braked.hidden.sizes["nm_per_radps"], rel=0.2
    )
