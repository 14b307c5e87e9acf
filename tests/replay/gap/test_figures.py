"""The figure blocks of docs/gap-worlds.md from rows written by hand."""

import importlib
import json
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
NAMED = {"verdict": "named", "sentence": "", "notes": [], "cpu_s": 2.0}
SILENT = NAMED | {"verdict": "nothing_missing", "effects": []}


@pytest.fixture(scope="module")
def bench():
    """``bench(name)``: a module of bench/."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "bench"))
        yield importlib.import_module


def said(*names, **alternatives):
    return [
        {"name": name, "class": [name], "alternatives": alternatives, "parameters": {"size": [1.0, 0.5, 1.5]}}
        for name in names
    ]


def world_row(seed, effect, outcome, **more):
    row = {"plant": 1, "family": "dash", "noise": "rtk", "effect": effect, "seed": seed, "outcome": outcome}
    row |= {"inseparable": [], "own": 50.0, "holds": {}, "same_form": True, "key": f"world/{seed}"}
    return row | SILENT | more


WORLDS = [
    world_row(600000, "payload", "right", **NAMED, effects=said("payload"), holds={"mass_ratio": True}),
    world_row(600001, "slope", "right", own=3.0),
    world_row(600002, "slope", "refused", family="spiral"),
    world_row(600003, "payload", "wrong", **NAMED, effects=said("drive_gain", load_step=3.0)),
    world_row(600004, "", "silent"),
    world_row(600005, "", "false", **NAMED, effects=said("unnamed:yaw:v*|v|")),
    world_row(600006, "", "not driven", error="RanAway"),
]


def engine_row(seed, effect, outcome, **more):
    row = {"robot": "porter", "family": "wander", "noise": "poor", "effect": effect, "seed": seed}
    row |= {"outcome": outcome, "sizes": {"ratio": 0.1} if effect else {}, "key": f"engine/{seed}"}
    judged = {"own": 40.0, "crossings": None, "may_refuse": False} if effect else {}
    return row | SILENT | judged | more


NAMES = {"payload": ["payload"], "gear": ["drive_gain"], "slick_patch": ["low_friction_patch"]}
AGAIN = NAMED | {"effects": said("slope")}
ENGINE = [
    engine_row(300000, "payload", "right", **NAMED, effects=said("payload"), second=SILENT),
    engine_row(300001, "gear", "right", **NAMED, effects=said("drive_gain"), second=AGAIN),
    engine_row(300002, "gear", "refused", own=2.0, may_refuse=True),
    engine_row(300003, "slick_patch", "refused", crossings=3),
    engine_row(300005, "gear", "among", rivals={"actuator_lag": 20.0}),
    engine_row(300006, "gear", "among", rivals={"actuator_lag": 20.0, "payload": None}),
    engine_row(300007, "gear", "among", rivals={"actuator_lag": 40.0}),
    engine_row(300004, "", "silent"),
]


def formula_row(seed, form, **more):
    row = {"form": form, "modes": "given", "plant": 3, "family": "parking", "noise": "mocap", "effect": ""}
    row |= {"seed": seed, "channel": False, "variables": False, "parity": False, "right": False, "r2": 0.0}
    return row | {"own": 90.0, "moved_m": 0.1, "near": {}, "apart": False} | SILENT | more


RIGHT = {"channel": True, "variables": True, "parity": True, "right": True, "r2": 0.97}
FORMULAS = [
    formula_row(700000, "bowl", **RIGHT, **NAMED, effects=said("unnamed:longitudinal:v")),
    formula_row(700001, "bowl", own=0.2, apart=True),
    formula_row(700002, "fan_drag", **NAMED, effects=said("aerodynamic_drag")),
    formula_row(700003, "fan_drag", **RIGHT | {"r2": 0.5}, **NAMED, effects=said("unnamed:longitudinal:v")),
]


def line_of(text, start):
    """The first line of the tables that begins with a cell."""
    return next(line for line in text.splitlines() if line.startswith(f"| {start} |"))


def test_worlds_tell_right_refusals_from_wrong_ones(bench):
    found = bench("worlds.figures").blocks(WORLDS)
    assert "6 logs, seeds 600000 to 600005, of `dash`, `spiral`; 1 more ran away" in found["worlds_report"]
    assert "50.0 % (2 of 4; 15.0 to 85.0)" in line_of(found["worlds_report"], "one effect hidden: right")
    assert "(1 of 4;" in line_of(found["worlds_report"], "– refused where the oracle refuses")
    assert "spiral: 0.0 % (0 of 1;" in line_of(found["worlds_report"], "– right in the worst family")
    assert "dash: 50.0 % (1 of 2;" in line_of(found["worlds_report"], "– in the worst family")
    assert line_of(found["worlds_hidden"], "dash / 1").endswith("| 1 | 1 | 0 | 1 | 0 |")
    assert "50.0 % (1 of 2;" in line_of(found["worlds_nothing"], "dash")


def test_calm_drives_are_counted_apart(bench):
    nothing = [row for row in WORLDS if not row["effect"] and row["outcome"] != "not driven"]
    named = [row | {"demand_mps2": 0.1} for row in nothing if row["outcome"] == "false"]
    rest = [row | {"demand_mps2": 0.5} for row in nothing if row["outcome"] != "false"]
    quiet = [row | {"demand_mps2": 0.2} for row in rest]
    for calm, expected in (([*named, *rest], "(1 of 1;"), ([*named, *quiet], f"(1 of {1 + len(quiet)};")):
        report = bench("worlds.figures").blocks(calm)["worlds_report"]
        (line,) = (line for line in report.splitlines() if "on calm drives" in line)
        assert expected in line


def test_every_failure_of_the_worlds_is_listed_and_no_other_log(bench):
    lines = bench("worlds.figures").blocks(WORLDS)["worlds_failures"].splitlines()[2:]
    assert [line.split(" | ")[0] for line in lines] == ["| 600002", "| 600003", "| 600005"]
    assert "`drive_gain (load_step)`" in lines[1]
    assert "`yaw:v*/v/`" in lines[2]


def test_the_engine_counts_what_the_oracle_lets_refuse_beside_what_is_right(bench):
    found = bench_engine(bench).blocks(ENGINE, names_of)
    assert "(2 of 7;" in line_of(found["engine_report"], "one effect hidden: an accepted name")
    assert "(4 of 7;" in line_of(found["engine_report"], "– or as the oracle: refused or ambiguous")
    assert "(3 of 6;" in line_of(found["engine_report"], "– logs that tell alone")
    assert "| `gear` | drive_gain | 5 |" in found["engine_hidden"]
    assert "50.0 % (1 of 2;" in line_of(found["engine_second"], "porter")
    assert "`slope`" in line_of(found["engine_second"], "300001")
    assert "40, 3 crossings" in line_of(found["engine_failures"], "300003")


def test_a_report_by_wheel_speeds_has_blocks_of_its_own(bench):
    by_torques = bench_engine(bench).blocks(ENGINE, names_of)
    by_wheels = bench_engine(bench).blocks(ENGINE, names_of, "wheels")
    assert {name.replace("engine_", "wheels_"): text for name, text in by_torques.items()} == by_wheels


def names_of(_robot):
    return NAMES


def bench_engine(bench):
    pytest.importorskip("mujoco")
    return bench("engine.figures")


def test_formulas_leave_out_a_log_that_shows_nothing_right_or_not(bench):
    found = bench("formulas.figures").blocks(FORMULAS)
    report = found["formulas_report"]
    assert "(2 of 4;" in line_of(report, "channel, variables and parity right")
    assert "(2 of 3;" in line_of(report, "– without failures that the oracle excuses")
    lucky = [formula_row(700004, "bowl", **RIGHT, own=0.1)]
    report = bench("formulas.figures").blocks([*FORMULAS, *lucky])["formulas_report"]
    assert "(3 of 4;" in line_of(report, "– without failures that the oracle excuses")
    assert "(2 of 3;" in line_of(report, "– without all logs that show nothing, right ones too")
    assert "(1 of 4;" in line_of(found["formulas_report"], "R² ≥ 0.9")
    assert line_of(found["formulas_apart"], "700001").endswith("| 0 | – | 100.0 mm |")


def test_an_answer_that_the_log_does_not_tell_from_the_form_is_counted_beside_right_ones(bench):
    near, silent, far = (
        formula_row(700005 + k, "bowl", left=left, apart=left < 33, **NAMED, effects=effects)
        for k, (left, effects) in enumerate(((5.0, said("unnamed:yaw:v")), (5.0, []), (50.0, said("slope"))))
    )
    found = bench("formulas.figures").blocks([*FORMULAS, near, silent, far])
    assert "(3 of 7;" in line_of(found["formulas_report"], "– or nothing that the log tells from the form")
    assert line_of(found["formulas_apart"], "700005").endswith("| 90 | 5 | 100.0 mm |")


def test_the_oracle_holds_an_answer_against_the_form_itself(bench):
    case = bench("worlds.case").Case(2, "patrol", "mocap", "", 7, 20.0)
    world = bench("formulas.plants").hidden_world("bad_bearing", case)
    coefficient = world.hidden.sizes["c"] * (1 if world.hidden.sizes["side"] > 0 else -1)
    difference, own = bench("formulas.oracle").difference, bench("formulas.oracle").difference(world, [])
    assert own > 100.0
    for share in (1.0, 0.5, 0.9):
        says = [{"name": "unnamed:yaw:v", "parameters": {"coefficient": [share * coefficient]}}]
        assert difference(world, says) == pytest.approx((1 - share) ** 2 * own, rel=1e-6, abs=1e-6)
    assert difference(world, [{"name": "pose_delay", "parameters": {"delay_s": [0.1]}}]) == float("inf")
    bias = [{"name": "torque_bias_differential", "parameters": {"bias_nm": [0.01]}}]
    assert 0.0 < difference(world, [*says, *bias]) < float("inf")


def test_formulas_list_failures_and_right_ones_that_fit_worse(bench):
    lines = bench("formulas.figures").blocks(FORMULAS)["formulas_failures"].splitlines()[2:]
    assert [line.split(" | ")[0] for line in lines] == ["| 700002", "| 700003"]


def test_without_logs_that_hide_nothing_their_block_stays(bench):
    assert "formulas_nothing" not in bench("formulas.figures").blocks(FORMULAS)
    nothing = [formula_row(700005, ""), formula_row(700006, "", effects=said("unnamed:yaw:v"))]
    found = bench("formulas.figures").blocks(nothing)
    assert "50.0 % (1 of 2;" in line_of(found["formulas_nothing"], "a term")


def test_the_page_has_a_place_for_every_block_and_each_keeps_its_end(bench, tmp_path, monkeypatch):
    pytest.importorskip("mujoco")
    page = tmp_path / "gap-worlds.md"
    before = (ROOT / "docs/gap-worlds.md").read_text()
    page.write_text(before)
    arguments = [f"--page={page}"]
    nothing = [formula_row(700005, "")]
    for name, rows in (
        ("worlds", WORLDS),
        ("engine", ENGINE),
        ("wheels", ENGINE),
        ("formulas", [*FORMULAS, *nothing]),
    ):
        path = tmp_path / f"{name}.jsonl"
        path.write_text("".join(json.dumps(row) + "\n" for row in rows))
        arguments += [f"--{name}", str(path)]
    monkeypatch.setattr(sys, "argv", ["gap_worlds_page.py", *arguments])
    bench("gap_worlds_page").main()
    blocks = bench("figure_blocks")
    assert blocks.names(page.read_text()) == blocks.names(before)
    assert [*blocks.BLOCK.sub("", before)] == [*blocks.BLOCK.sub("", page.read_text())]
    kept = [block[3] for block in blocks.BLOCK.finditer(before) if block[3] in page.read_text()]
    assert not kept
    bench("gap_worlds_page").main()
    assert "600003" in page.read_text()


def test_a_block_without_a_place_is_an_error(bench):
    with pytest.raises(ValueError, match="no block gone"):
        bench("figure_blocks").filled("<!-- figures here -->\n<!-- end here -->", {"gone": ""})


def test_a_share_has_wilsons_interval(bench):
    assert bench("figure_blocks").share(37, 49) == "75.5 % (37 of 49; 61.9 to 85.4)"
