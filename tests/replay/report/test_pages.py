"""The pages of reports: well-formed, closed to the network, names shown and never read, figures that draw."""

import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import wmr_replay as wr
from wmr_replay.api.gap import Gap
from wmr_replay.gap import GapOptions
from wmr_replay.gap.result.result import CandidateScore, Formula
from wmr_replay.jobs.gap import GapRun, write_gap
from wmr_replay.jobs.gap_document import document_of
from wmr_replay.jobs.gap_traces import traces_frame
from wmr_replay.report import bundle
from wmr_replay.report.gap import gap_page
from wmr_replay.report.gap_figures import level_words
from wmr_replay.report.run import RunTables, run_page
from wmr_schemas.errors import InvalidSetting, MissingExtra
from wmr_schemas.findings import KINDS
from wmr_schemas.tables import GAP_TRACES, HINDSIGHT, SAMPLES, polars_schema

vl_convert = pytest.importorskip("vl_convert")
BAD = "</script><script>alert(1)</script><img src=x onerror=alert(2)>&amp;\"'<!--"
SHA = "0" * 64


@pytest.fixture(scope="module")
def result(log):
    return wr.run(log)


@pytest.fixture(scope="module")
def run_text(result):
    """The page of a replay whose names and texts act in HTML."""
    tables = result.report_tables()
    kind = next(iter(KINDS.values()))
    finding = {"code": kind.code, "severity": "bars", "text": BAD, "meaning": BAD, "advice": BAD}
    settings = json.dumps(result.settings | {"mapping": BAD})
    summary = dict(tables.summary) | {"log": BAD, "verdict": BAD, "settings": settings}
    summary |= {
        "notes": json.dumps([BAD]),
        "findings": json.dumps([finding | {"n": 1, "where": [[1.0, 2.0]]}]),
    }
    return run_page(replace(tables, summary=summary), BAD)


def document(made_up_gap, **changes):
    made = made_up_gap.gap_result(**changes)
    return document_of(made, GapOptions(), BAD, SHA), traces_frame(made.traces)


@pytest.fixture(scope="module")
def gap_text(made_up_gap):
    """The page of a gap analysis whose names act in HTML."""
    bad = replace(made_up_gap.EFFECT, name=f"own_{BAD}", formula=BAD, separate_with=BAD)
    gap, traces = document(made_up_gap, effects=(bad,), notes=(BAD,), sentence=BAD)
    return gap_page(gap, traces, BAD)


@pytest.mark.parametrize("which", ["run_text", "gap_text"])
def test_a_page_is_well_formed_and_loads_nothing_whatever_the_names(which, request, page_reader):
    read = page_reader.checked(request.getfixturevalue(which))
    assert read.text.count(BAD) >= 5
    assert [tag for tag, _ in read.elements].count("script") == 3
    assert "img" not in {tag for tag, _ in read.elements}


def test_names_inside_the_figures_read_back_as_they_were(gap_text, page_reader):
    figures = page_reader.Reader(gap_text).figures()
    assert any(BAD in name for name in figures["specs"])
    assert "<" not in gap_text.partition('id="figures">')[2].partition("</script>")[0]


@pytest.mark.parametrize("which", ["run_text", "gap_text"])
def test_every_figure_draws_numbers_alone(which, request, page_reader):
    figures = page_reader.Reader(request.getfixturevalue(which)).figures()
    for name, spec in figures["specs"].items():
        drawn = vl_convert.vegalite_to_svg(
            page_reader.with_rows(spec, figures["data"]), vl_version=bundle.VEGA_LITE
        )
        assert "NaN" not in drawn, name
        assert drawn.count("<path") > 3, name


def test_a_replay_says_what_it_found_in_the_order_of_interest(result, log, page_reader):
    read = page_reader.checked(run_page(result.report_tables(), "drive"))
    places = [
        read.text.index(word) for word in (result.verdict, "Data quality", "Path,", "Constraints", "α, acc")
    ]
    assert places == sorted(places)
    figures = read.figures()
    lanes = figures["data"]["lanes"]
    assert set(lanes["r"]) == {0, 1, 2}
    known = [row for row in zip(*lanes.values(), strict=True) if row[list(lanes).index("r")] == 0]
    assert [row[list(lanes).index("m")] for row in known] == [
        m.replace("_", " and ") for m in result.segments["mode"]
    ]


def test_a_gap_page_has_the_proof_and_its_numbers(made_up_gap, page_reader):
    read = page_reader.checked(gap_page(*document(made_up_gap), "drive"))
    for said in ("0.203", "0.196 … 0.21", "−c1·v", "rolling_resistance", "driving at a range", "hold-out"):
        assert said in read.text
    data = read.figures()["data"]
    before, after = (data[f"scatter_viscous_drag_{k}"] for k in (2, 3))
    assert np.polyfit(before["x"], before["y"], 1)[0] == pytest.approx(-0.2, abs=0.02)
    assert np.polyfit(after["x"], after["y"], 1)[0] == pytest.approx(0, abs=0.02)


def test_a_gap_page_says_a_formula_once(made_up_gap, page_reader):
    names = "unnamed:longitudinal:v", "unnamed:longitudinal:v*cos(yaw)"
    terms = [
        replace(made_up_gap.EFFECT, name=name, alternatives=(), confound_class=(name,)) for name in names
    ]
    text = "dv_long/dt += -0.2 1/s (-0.21 to -0.19)·v - 0.01 1/s (0.005 to 0.015)·v·cos(yaw) (odd in v)"
    table = made_up_gap.EFFECT.against
    formula = Formula("longitudinal", text, names, {"v": "odd"}, 0.1, {"v": (0.0, 1.0)}, "v_mps", table)
    scores = tuple(CandidateScore(0, name, 90.0, 80.0, 1e-9, "") for name in names)
    given = document(made_up_gap, effects=tuple(terms), formulas=(formula,), candidates=scores)
    read = page_reader.checked(gap_page(*given, "drive"))
    assert "dv_long/dt += -0.2 1/s·v - 0.01 1/s·v·cos(yaw) (odd in v)" in read.text
    assert "The same with the formula in the model" in read.text
    assert read.text.count("no effect of the library moves as it does") == 1
    assert [name for name in read.figures()["data"] if name.startswith("scatter")] == [
        f"scatter_formula_longitudinal_{k}" for k in range(4 + (table is not None))
    ]
    assert "the formula" in read.text.partition("Candidates and their scores")[2].partition("Alternatives")[0]
    assert names[1] not in read.text.partition("Candidates and their scores")[2].partition("What remains")[0]


@pytest.mark.parametrize("verdict", ["nothing_missing", "not_enough_excitation"])
def test_a_gap_page_without_an_effect(made_up_gap, verdict, page_reader):
    read = page_reader.checked(gap_page(*document(made_up_gap, verdict=verdict, effects=()), "drive"))
    assert "would have been seen from" in read.text


def by_wheels(result):
    """The tables of a replay as if wheel speeds had shown slip and scale, and no torque C_d and α."""
    tables, none = result.report_tables(), pl.lit(None, pl.Float64)
    known = {"slip_left_mps": 0.3, "slip_right_mps": -0.2, "wheel_scale": 1.02, "icr_offset_m": 0.01}
    known |= {"effective_half_track_m": 0.25}
    values = [pl.lit(value).alias(name) for name, value in known.items()]
    spread = [pl.lit(0.01).alias(f"{name}_sd") for name in known]
    lacking = [none.alias(name) for name in ("alpha", "alpha_sd", "c_d_mps2")]
    return replace(tables, samples=tables.samples.with_columns(*values, *spread, *lacking))


def test_wheel_speeds_show_slip_and_what_was_learnt_and_no_empty_figure(result, page_reader):
    read = page_reader.checked(run_page(by_wheels(result), "drive"))
    for words in ("Slip of the left wheel", "Slip of the right wheel", "Wheel scale", "as stated: 1"):
        assert words in read.text
    assert "C_d" not in read.text
    assert "α, acceleration" not in read.text


def test_a_picture_of_wheel_speeds_has_no_empty_axes(result):
    pytest.importorskip("matplotlib")
    from wmr_replay.api.plots.run import tables_figure

    axes = tables_figure(by_wheels(result), "drive").axes
    assert all(one.has_data() for one in axes)
    assert [one.get_title(loc="left") or one.get_title() for one in axes][-2:] == [
        "Slip of the wheels [m/s], 95 % intervals",
        "Wheel scale with its 95 % interval",
    ]


def test_results_of_earlier_versions_without_columns_of_wheels_are_drawn(result, page_reader):
    tables = result.report_tables()
    older = replace(tables, samples=tables.samples.drop("slip_left_mps", "wheel_scale", "icr_offset_m_sd"))
    assert "α, acceleration" in page_reader.checked(run_page(older, "drive")).text


def test_a_page_of_nothing(result, page_reader):
    tables = result.report_tables()
    row = dict(tables.summary) | {"alpha": None, "alpha_sd": None, "rate_hz": None, "duration_s": 0.0}
    empty = RunTables(
        row, pl.LazyFrame(schema=polars_schema(SAMPLES)), pl.LazyFrame(schema=polars_schema(HINDSIGHT))
    )
    assert not page_reader.checked(run_page(empty, "nothing")).drawn()


def long_tables(result, n):
    rng = np.random.default_rng(3)
    real = {
        name: rng.standard_normal(n) for name, dtype in polars_schema(SAMPLES).items() if dtype == pl.Float64
    }
    walk = {axis: rng.standard_normal(n).cumsum() for axis in ("x_m", "y_m")}
    modes = rng.integers(-1, 4, n)
    fixed = {"t_s": np.arange(n) * 0.01, "delay_s": np.full(n, 0.1), "mode": modes, "mode_true": modes}
    columns = real | walk | fixed | {"alpha_sd": np.full(n, 0.1)}
    samples = pl.DataFrame(columns).with_columns(pl.col("mode", "mode_true").cast(pl.Int8)).lazy()
    return RunTables(result.summary.row(0, named=True), samples, samples)


def test_an_hour_is_hardly_larger_than_five_minutes_and_below_3_mb(result, page_reader):
    sizes = []
    for n in (20_000, 360_000):
        page = run_page(long_tables(result, n), "long")
        assert len(page.encode()) < 3e6
        sizes.append(len(page) - len(bundle.figure_script()))
    assert sizes[1] < 1.3 * sizes[0]
    page_reader.Reader(page)


def test_without_the_extra_the_message_names_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "vl_convert", None)
    with pytest.raises(MissingExtra, match=r"wmr-replay\[report\]"):
        bundle.check_extra()


def test_the_script_is_packed_once(monkeypatch, tmp_path):
    monkeypatch.setenv("WMR_REPLAY_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(bundle, "packed", lambda: "packed();")
    bundle.figure_script.cache_clear()
    try:
        assert bundle.figure_script() == "packed();"
        monkeypatch.setattr(bundle, "packed", lambda: pytest.fail("packed twice"))
        bundle.figure_script.cache_clear()
        assert bundle.figure_script() == "packed();"
    finally:
        bundle.figure_script.cache_clear()


def test_a_run_without_a_report_leaves_no_old_one(command, log, tmp_path):
    command("run", log, "--out", tmp_path, "--no-rrd", "--report")
    page = tmp_path / "drive.report.html"
    assert page.read_text(encoding="utf-8").startswith("<!doctype html>")
    command("run", log, "--out", tmp_path, "--no-rrd")
    assert not page.exists()


def test_stored_results_give_the_page_of_those_in_memory(result, tmp_path):
    files = result.save(tmp_path, timeline=False)
    fresh = result.report(tmp_path / "memory.html").read_text(encoding="utf-8")
    for given in (tmp_path, files["summary"], files["segments"]):
        assert wr.report(given, tmp_path / "stored.html").read_text(encoding="utf-8") == fresh
    assert wr.report(tmp_path) == tmp_path / "drive.report.html"


@pytest.fixture
def gap_run(made_up_gap, result):
    made = made_up_gap.gap_result()
    return GapRun(document_of(made, GapOptions(), "drive.mcap", SHA), made, None, Path("drive.mcap"), SHA)


def test_a_gap_analysis_writes_its_traces_and_its_page(gap_run, tmp_path, page_reader):
    files = write_gap(gap_run, tmp_path, timeline=False, report=True)
    assert sorted(path.name for path in files.values()) == [
        "drive.gap.html",
        "drive.gap.json",
        "drive.gap_traces.parquet",
        "drive.model.toml",
    ]
    traces = pl.read_parquet(files["traces"])
    assert traces.schema == polars_schema(GAP_TRACES)
    assert traces["base_x_m"].null_count() == 40
    gap = np.hypot(traces["x_m"] - traces["base_x_m"], traces["y_m"] - traces["base_y_m"])
    np.testing.assert_allclose(traces["base_error_m"].drop_nulls(), gap.drop_nulls())
    page_reader.checked(files["report"].read_text(encoding="utf-8"))
    stored = wr.report(files["json"], tmp_path / "again.html").read_text(encoding="utf-8")
    assert stored.replace("<h1>drive</h1>", "") != stored
    write_gap(gap_run, tmp_path, timeline=False)
    assert not files["report"].exists()


def test_stored_results_as_pictures(command, gap_run, result, tmp_path):
    pytest.importorskip("matplotlib")
    result.save(tmp_path / "run", timeline=False)
    write_gap(gap_run, tmp_path / "gap", timeline=False)
    heads = {"png": b"\x89PNG", "svg": b"<?xml"}
    for kind, ending in (("run", "png"), ("gap", "svg")):
        target = tmp_path / f"{kind}.{ending}"
        assert "wrote" in command("plot", tmp_path / kind, "-o", target).stdout
        assert target.read_bytes().startswith(heads[ending])
    drawn = Gap(gap_run).plot()
    assert len(drawn.axes) == 5
    assert all(axes.has_data() for axes in drawn.axes)


def test_what_is_no_result_is_said(command, result, tmp_path):
    with pytest.raises(InvalidSetting, match="no result"):
        wr.report(tmp_path)
    for name in ("a", "b"):
        (tmp_path / f"{name}.summary.parquet").touch()
    with pytest.raises(InvalidSetting, match="2 results"):
        wr.plot(tmp_path)
    with pytest.raises(InvalidSetting, match="path"):
        wr.report(result)
    assert "ends in" in command("plot", tmp_path, "-o", tmp_path / "a.bmp", code=2).stderr


def test_two_results_side_by_side(result, log, tmp_path, page_reader):
    other = wr.run(log, identifier="paper")
    found = wr.compare(result, other)
    files = found.save(tmp_path, timeline=False, report=True)
    read = page_reader.checked(files["report"].read_text(encoding="utf-8"))
    assert f"{found.other_mode_share:.2%}" in read.text
    same = wr.compare(result, result).report(tmp_path / "same.html").read_text(encoding="utf-8")
    assert "no difference" in page_reader.checked(same).text
    found.save(tmp_path, timeline=False)
    assert not files["report"].exists()


def test_errors_of_a_metre_are_written_out():
    assert level_words(np.array([0.25, 0.5, 1.0, 1.5]))[-2:] == ["1000–1500", "above 1500 mm"]
