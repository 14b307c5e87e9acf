"""What the answers on torques and on wheel speeds say together."""

import msgspec
import pytest

from wmr_replay.jobs.both_bases import bases_of
from wmr_schemas.gap_file import Effect, Estimate, GapFile

SIDE = {"before": 0.1, "after": 0.1}
GAP = {
    "unit": "m",
    "metric": "position_rms_4s",
    "windows": 3,
    "train": SIDE,
    "held_out": {**SIDE, "floor": 0.01, "reduction_ci95": (0.0, 0.0), "p_value": 1.0},
}
EMPTY = {
    "sentence": "",
    "where": {"channels": {}, "intervals": (), "regions": (), "regime": {}},
    "gap": {**GAP, "yaw": {**GAP, "unit": "rad", "metric": "yaw_rms_4s"}},
    "modes": "identified",
    "base": "metadata record",
    "unnameable": (),
    "notes": (),
    "model": {},
    "log": "a.mcap",
    "log_sha256": "0" * 64,
    "settings": {"tolerance_m": 0.003, "tolerance_s": 4.0, "max_effects": 3},
    "seed": 0,
    "version": "0",
}


def effect(name, key, value, half, confounds=()):
    """An effect with one parameter."""
    estimate = Estimate(value, (value - half, value + half), "1")
    return Effect(name, "both", "", {key: estimate}, (name, *confounds), (), 1e-9, "")


def answer(base_model, *effects, seen=()):
    """The document of an analysis that names some effects, and would have shown those in ``seen``."""
    verdict = "named" if effects else "nothing_missing"
    least = {name: {"value": size, "unit": "1"} for name, size in seen}
    contents = EMPTY | {"verdict": verdict, "effects": (), "minimum_detectable": least}
    document = msgspec.convert(contents | {"base_model": base_model}, GapFile)
    return msgspec.structs.replace(document, effects=tuple(effects))


DRAG = effect("viscous_drag", "c1_per_s", 0.2, 0.01)
GAIN = effect("drive_gain", "ratio", 0.05, 0.01, ("torque_constant", "wheel_radius"))
SCALE = effect("wheel_scale", "ratio", -0.05, 0.01, ("constant_slip_ratio", "wheel_radius"))
TRACK = effect("effective_track", "ratio", 0.2, 0.01, ("half_track",))
TURNED = effect("heading_misalignment", "angle_rad", 0.05, 0.002)


@pytest.mark.parametrize(
    ("torque", "wheels", "said"),
    [
        ([], [], "Neither torques nor wheel speeds show"),
        ([DRAG], [], "What is missing lies between the torques and the motion of the wheels"),
        ([], [TRACK], "What is missing lies between the wheels and the ground"),
        ([DRAG], [TRACK], "Different things are missing on the two sides of the wheels"),
        ([GAIN], [SCALE], "Drive_gain on torques and wheel_scale on wheel speeds may be one wheel_radius"),
        ([TURNED], [TURNED], "Both bases name heading_misalignment, with sizes that agree"),
    ],
)
def test_both_answers_are_one_sentence(torque, wheels, said):
    both = bases_of(answer("torque", *torque), answer("wheel_speed", *wheels))

    assert both.sentence.lower().startswith(said.lower())
    assert both.torque.effects == tuple(e.name for e in torque)
    assert both.wheel_speed.effects == tuple(e.name for e in wheels)


def test_sizes_that_differ_are_said():
    other = effect("heading_misalignment", "angle_rad", 0.09, 0.002)
    both = bases_of(answer("torque", TURNED), answer("wheel_speed", other))

    assert both.same[0].sizes_agree is False
    assert "sizes that differ" in both.sentence


def test_an_effect_that_the_other_base_would_have_seen_is_disputed():
    seen = answer("wheel_speed", seen=[("heading_misalignment", 0.003)])
    unseen = answer("wheel_speed", seen=[("heading_misalignment", 0.3)])

    assert bases_of(answer("torque", TURNED), seen).disputed == ("heading_misalignment",)
    assert bases_of(answer("torque", TURNED), unseen).disputed == ()
