"""The Husky of the shared data: a third of its steps held out, against the best hand-made model."""

import csv

import pytest

import wmr_replay as wr

HAND_MADE_MM, HAND_MADE_MEDIAN_MM, HAND_MADE_MRAD = 185, 119, 235
IDEAL_MM, IDEAL_MRAD = 505, 1570
"""Over windows of 1.95 s; those of the analysis end with the last pose that repeats no other."""
MARGIN = 1.1
MAP = """
[columns]
time = "t_in_window_s"
window = "window"
x = "x"
y = "y"
yaw = "yaw"
speed_left = "wheel_vel_left"
speed_right = "wheel_vel_right"
[robot]
wheel_radius_m = 0.165
half_track_m = 0.275
"""


@pytest.fixture(scope="module")
def halves(shared_data, tmp_path_factory):
    """Logs of the steps that are fitted, and of those held out."""
    folder = tmp_path_factory.mktemp("husky")
    (folder / "columns.toml").write_text(MAP)
    with shared_data("robots", "drive_husky", "husky_windows.csv").open() as file:
        reader = csv.DictReader(file)
        rows, names = list(reader), reader.fieldnames
    for name, chosen in (("fitted", lambda k: k != 2), ("held_out", lambda k: k == 2)):
        with (folder / f"{name}.csv").open("w", newline="") as file:
            writer = csv.DictWriter(file, names)
            writer.writeheader()
            writer.writerows(row for row in rows if chosen(int(row["calib_step"]) % 3))
        wr.convert(folder / f"{name}.csv", folder / "columns.toml", folder / f"{name}.mcap")
    return folder / "fitted.mcap", folder / "held_out.mcap"


@pytest.mark.slow
def test_the_named_effects_predict_the_steps_that_were_held_out(halves):
    fitted, held_out = halves
    found = wr.gap(fitted)
    proof = wr.gap(held_out, model=found.model, base="wheel-speed", max_effects=1).document
    nominal = wr.gap(held_out, max_effects=1).document

    names = {effect.name for effect in found.document.effects}
    assert {"effective_track", "turning_slip", "icr_offset", "lateral_slip"} <= names
    ideal, left = nominal.odometry, proof.odometry
    assert 1e3 * ideal.position_rms_before_m == pytest.approx(IDEAL_MM, rel=0.1)
    assert 1e3 * ideal.yaw_rms_before_rad == pytest.approx(IDEAL_MRAD, rel=0.1)
    for key, least in (("position_rms_before_m", HAND_MADE_MM), ("yaw_rms_before_rad", HAND_MADE_MRAD)):
        assert 1e3 * getattr(left, key) < MARGIN * least, key
    assert 1e3 * left.position_median_before_m < MARGIN * HAND_MADE_MEDIAN_MM
