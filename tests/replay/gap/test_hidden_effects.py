"""The gap analysis on files with a hidden effect.

The simulator writes log and side files. The side files are deleted before the log is read. The effects have
other forms than the candidates', and seeds of their own.
"""

import json
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from wmr_replay.cli import main
from wmr_replay.gap import GapOptions, GapResult, analyse
from wmr_replay.ingest.reader import NO_MAPPING, WHOLE
from wmr_replay.ingest.tracks import read_whole
from wmr_schemas.effects import UNNAMED_PREFIX
from wmr_schemas.messages import MODE_TOPIC
from wmr_schemas.model_file import Effect, Model
from wmr_schemas.modes import ContactMode
from wmr_schemas.signals import Log
from wmr_synth.hidden import words_of


class Hidden(NamedTuple):
    """A result, and what was hidden: name → parameters."""

    result: GapResult
    truth: dict[str, dict[str, float]]


@pytest.fixture(scope="module")
def analysed(tmp_path_factory):
    """``analysed(seed, noise, *hide, modes="given", options=())``: through files, each log once."""
    folder, known = tmp_path_factory.mktemp("hidden"), {}

    def run(seed: int, noise: str, *hide: str, modes: str = "given", options: tuple[str, ...] = ()) -> Hidden:
        key = (seed, noise, hide, modes, options)
        if key not in known:
            path = folder / f"{len(known)}.mcap"
            truth = written(path, seed, noise, hide, options)
            known[key] = Hidden(analyse(read(path, modes), None, GapOptions(modes=modes)), truth)
        return known[key]

    return run


def written(path: Path, seed: int, noise: str, hide: tuple[str, ...], options: tuple[str, ...]):
    """Write the log; take the truth out of the side files' folder for good."""
    chosen = [word for effect in hide for word in ("--hide", effect)]
    scenario, *rest = options or ("patrol",)
    words = ["wmr-replay", "synth", scenario, "--seed", str(seed), "--noise", noise, *chosen, *rest]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", [*words, "--out", str(path)])
        main()
    facts = json.loads(path.with_suffix(".truth.json").read_text())
    for side in (".truth.json", ".truth.parquet"):
        path.with_suffix(side).unlink()
    assert [file.name for file in path.parent.glob(f"{path.stem}.*")] == [path.name]
    return {effect["name"]: effect["parameters"] for effect in facts["effects"]}


def read(path: Path, modes: str) -> Log:
    """What stands in the file; its mode only where ``modes`` are given."""
    return read_whole(path, NO_MAPPING, WHOLE, MODE_TOPIC if modes == "given" else None).log


LOCAL = ("slip_interval", "low_friction_patch")
"""Most windows know nothing of what acts in one time or place."""
WRONG = ("patrol", "--wrong-modes", "0.02")
HIDDEN = {
    "viscous_drag:c1_per_s=.25": (90_001, "rtk"),
    "payload:mass_ratio=.45": (90_002, "poor"),
    "slope:grade_x_mps2=.3,grade_y_mps2=-.25": (90_003, "rtk"),
    "torque_imbalance:ratio=.15": (90_004, "mocap"),
    "rolling_resistance:c0_mps2=.25": (90_005, "mocap"),
    "undeclared_skid:stiffness_ratio=.7": (90_006, "rtk"),
    "yaw_drift:rate_radps=.004": (90_007, "poor"),
    "slip_interval:start_s=30,end_s=38,loss=.5": (90_016, "mocap"),
}


@pytest.mark.parametrize("hide", HIDDEN)
def test_a_hidden_effect_is_named_sized_and_proven_though_labels_are_wrong(analysed, hide):
    seed, noise = HIDDEN[hide]
    result, truth = analysed(seed, noise, hide, options=WRONG)
    assert result.verdict in ("named", "ambiguous")
    effect, *rest = result.effects
    assert all(one.name.startswith(UNNAMED_PREFIX) for one in rest)
    assert not rest or words_of(effect.name) != "as its candidate"  # such as a slope with bumps
    assert truth == {effect.name: truth[effect.name]}
    for key, value in truth[effect.name].items():
        found = effect.parameters[key]
        share = 0.1 if words_of(effect.name) == "as its candidate" else 0.35
        assert found.value == pytest.approx(value, rel=share)
        assert found.ci95[0] < found.value < found.ci95[1]
    held_out = result.position.held_out
    assert held_out.floor <= held_out.after < 0.8 * held_out.before
    assert held_out.reduction_ci95[0] > 0 or (effect.name in LOCAL and held_out.reduction_ci95[0] == 0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "noise", "hide"),
    [
        (90_008, "rtk", ("torque_bias_differential:bias_nm=-.3", "com_offset:offset_m=.025")),
        (90_009, "mocap", ("viscous_drag:c1_per_s=.2", "undeclared_skid:stiffness_ratio=.6")),
        (90_010, "rtk", ("heading_misalignment:angle_rad=.06", "payload:mass_ratio=.4")),
    ],
)
def test_two_effects_are_found_though_one_hides_the_other(analysed, seed, noise, hide):
    result, truth = analysed(seed, noise, *hide, options=WRONG)
    assert {effect.name for effect in result.effects} == set(truth)
    for effect in result.effects:
        for key, value in truth[effect.name].items():
            assert effect.parameters[key].value == pytest.approx(value, rel=0.12)


@pytest.mark.parametrize(("seed", "noise"), [(90_011, "mocap"), (90_012, "rtk"), (90_013, "poor")])
def test_nothing_is_named_where_nothing_is_missing(analysed, seed, noise):
    result = analysed(seed, noise, options=WRONG).result
    assert result.verdict == "nothing_missing"
    assert not result.effects
    assert result.position.held_out.before == pytest.approx(result.position.held_out.after)
    assert {"viscous_drag", "payload"} <= set(result.minimum_detectable)


def test_a_strong_coloured_disturbance_is_no_effect(analysed):
    result = analysed(90_014, "mocap", options=("patrol", "--disturbance", ".1:1")).result
    assert not result.effects


def test_a_cruise_does_not_allow_a_verdict(analysed):
    result = analysed(90_015, "rtk", options=("cruise",)).result
    assert result.verdict == "not_enough_excitation"
    assert result.notes


@pytest.mark.slow
def test_what_a_log_cannot_tell_says_what_identified_modes_may_hide(analysed):
    options = ("patrol", "--disturbance", ".1:1", "--no-truth-topic")
    result = analysed(90_104, "rtk", modes="identified", options=options).result
    assert result.verdict == "not_enough_excitation"
    assert any(note.startswith("slipping is identified for") for note in result.notes)
    assert any(note.startswith("skidding is identified for") for note in result.notes)
    assert "is identified for" not in result.sentence


@pytest.mark.slow
def test_without_any_labels_the_effect_is_named_all_the_same(analysed):
    options = ("patrol", "--no-truth-topic")
    found = analysed(90_021, "rtk", "viscous_drag:c1_per_s=.25", modes="identified", options=options)
    assert [effect.name for effect in found.result.effects] == ["viscous_drag"]
    assert found.result.modes == "identified"


@pytest.mark.parametrize(
    ("seed", "hide"),
    [
        (90_023, "heading_misalignment:angle_rad=.06"),
        (90_025, "yaw_drift:rate_radps=-.005"),
    ],
)
def test_what_an_identifier_takes_for_skidding_is_named_all_the_same(analysed, seed, hide):
    found = analysed(seed, "rtk", hide, modes="identified", options=("patrol", "--no-truth-topic"))
    assert [effect.name for effect in found.result.effects] == list(found.truth)


@pytest.mark.slow
def test_a_skid_that_an_identifier_sees_is_a_mode_and_its_tyres_are_what_is_missing(analysed):
    """The tyres hold .6 of the model's force; that they skid is no effect, once the modes say so."""
    hide, options = "undeclared_skid:stiffness_ratio=.6", ("patrol", "--no-truth-topic")
    result = analysed(90_024, "rtk", hide, modes="identified", options=options).result
    assert np.mean(result.traces.mode == ContactMode.SKIDDING) > 0.5
    (effect,) = result.effects
    low, high = effect.parameters["ratio"].ci95
    assert effect.name == "cornering_stiffness"
    assert low < -0.4 < high


def test_labels_are_read_only_when_asked_for(tmp_path):
    path = tmp_path / "labelled.mcap"
    written(path, 90_022, "rtk", ("payload:mass_ratio=.4",), WRONG)
    labelled = read(path, "given")
    assert labelled.mode is not None
    blind = Log(labelled.pose, labelled.torque, None, labelled.robot)
    options = GapOptions(modes="identified")
    told, untold = analyse(labelled, None, options), analyse(blind, None, options)
    assert told.effects == untold.effects
    np.testing.assert_array_equal(told.traces.mode, untold.traces.mode)


def test_what_the_library_has_no_name_for_is_described_by_a_term(analysed, tmp_path):
    path, name = tmp_path / "log.mcap", "unnamed:longitudinal:v*abs(yaw_rate)"
    written(path, 90_040, "rtk", (), ())
    wrong = Model(effects=(Effect(name, {"coefficient": 0.4}),))
    result = analyse(read(path, "given"), wrong, GapOptions(modes="given"))
    (effect,) = result.effects
    assert (result.verdict, effect.name) == ("unnamed", name)
    low, high = effect.parameters["coefficient"].ci95
    assert low < -0.4 < high or abs(effect.parameters["coefficient"].value + 0.4) < 0.06
