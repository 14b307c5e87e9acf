"""The page of a batch: rows that sort, odd logs by the stated rule, links, dates."""

import re

import numpy as np
import polars as pl
import pytest

from wmr_replay.fleet.reports import write_reports
from wmr_replay.fleet.stores import store_at
from wmr_replay.gap import GapOptions
from wmr_replay.jobs.gap_document import document_of
from wmr_replay.report.fleet import fleet_page
from wmr_replay.report.fleet_logs import JUDGED, FleetLog, odd_ones, robust_scores
from wmr_schemas.gap_file import gap_to_json

pytest.importorskip("vl_convert")
BAD = "</td><script>alert(1)</script>\"'"
START_NS = 1_760_000_000_000_000_000
DAY_NS = 86_400_000_000_000
TOTAL = {"hours": 1.0, "share_ideal": 0.8, "share_skidding": 0.2, "accuracy": None, "n_with_truth": 0}
ALPHA = next(one for one in JUDGED if one.name == "alpha")


def row(k, alpha, **more):
    shares = {"share_ideal": 0.8, "share_skidding": 0.2}
    named = {"log": f"drive{k}-abc", "path": f"/logs/drive{k}.mcap", "state": "done", "duration_s": 60.0}
    return named | shares | {"alpha": alpha, "alpha_sd": 0.001, "accuracy": None, "rate_hz": 50.0} | more


@pytest.fixture
def logs(made_up_gap):
    gap = document_of(made_up_gap.gap_result(), GapOptions(), "a", "0" * 64)
    values = (0.50, 0.51, 0.49, 0.50, 0.70, 0.505)
    return [
        FleetLog(row(k, v), START_NS + k * DAY_NS, f"reports/{k}.html", gap) for k, v in enumerate(values)
    ]


def test_the_rule_for_odd_numbers_is_the_one_that_is_stated():
    values = np.array([0.50, 0.51, 0.49, 0.50, 0.70, np.nan])
    deviations = np.abs(values[:5] - 0.50)
    expected = (values[:5] - 0.50) / (1.4826 * sorted(deviations)[2])
    found = robust_scores(values, ALPHA)
    np.testing.assert_allclose(found[:5], expected)
    assert found[5] == 0
    assert not robust_scores(values[:4], ALPHA).any()
    assert not (np.abs(robust_scores(np.array([0.5, 0.5, 0.5, 0.5, 0.5001]), ALPHA)) > 3.5).any()


def test_odd_logs_are_marked_and_say_why(logs):
    odd = odd_ones(logs, [ALPHA])
    assert [bool(one) for one in odd] == [False, False, False, False, True, False]
    assert odd[4][0].startswith("α high (z +")
    barred = FleetLog(row(9, 0.5), findings=[{"severity": "bars", "code": "torque_sign"}])
    assert odd_ones([*logs, barred], [ALPHA])[-1] == ["torque_sign bars an answer"]


def test_the_page_links_each_report_and_shows_every_trend(logs, page_reader):
    read = page_reader.checked(fleet_page(logs, TOTAL, "fleet"))
    links = [values["href"] for tag, values in read.elements if tag == "a"]
    assert links == [f"reports/{k}.html" for k in range(6)]
    figures = read.figures()
    assert {"trend_alpha", "trend_gap_mm", "shares"} <= set(figures["data"])
    assert figures["data"]["trend_alpha"]["x"] == [(START_NS + k * DAY_NS) / 1e6 for k in range(6)]
    assert figures["data"]["trend_alpha"]["c"].count("#d55e00") == 1
    assert "2025-10-09" in read.text


def test_every_head_of_the_table_sorts_by_a_value(logs, page_reader):
    page = fleet_page(logs, TOTAL, "fleet")
    read = page_reader.checked(page)
    heads = [values for tag, values in read.elements if tag == "th" and "data-sort" in values]
    body = page.partition('class="sortable"')[2].partition("</tbody>")[0].partition("<tbody>")[2]
    rows = re.findall(r"<tr.*?</tr>", body, re.DOTALL)
    assert len(rows) == 6
    for one in rows:
        assert one.count("data-v=") == len(heads)


def test_names_and_problems_of_logs_are_text(logs, page_reader):
    failed = FleetLog({"log": None, "state": "failed", "problem": BAD, "path": BAD, "duration_s": None})
    named = FleetLog(row(7, 0.5, path=f"/logs/{BAD}"), START_NS)
    read = page_reader.checked(fleet_page([*logs, named, failed], TOTAL, BAD))
    assert read.text.count("<script>alert(1)</script>") >= 3
    assert "1 failed" in read.text


def test_logs_without_dates_are_drawn_in_their_order(page_reader):
    logs = [FleetLog(row(k, 0.5), 1_000_000_000) for k in range(3)]
    read = page_reader.checked(fleet_page(logs, TOTAL, "fleet"))
    assert read.figures()["data"]["trend_alpha"]["x"] == [1.0, 2.0, 3.0]
    assert not page_reader.checked(fleet_page([], TOTAL, "fleet")).drawn()


def test_a_batch_writes_its_pages_and_takes_gap_analyses_up(command, log, tmp_path, made_up_gap, page_reader):
    out = tmp_path / "fleet"
    command("batch", log, "--out", out, "--jobs", "1", "--report")
    (page,) = (out / "reports").glob("*.html")
    page_reader.checked(page.read_text(encoding="utf-8"))
    before, stamp = (out / "report.html").read_text(encoding="utf-8"), page.stat().st_mtime_ns
    fleet = pl.read_parquet(out / "fleet.parquet")
    gap = document_of(made_up_gap.gap_result(), GapOptions(), "a", fleet["log_sha256"][0])
    (out / "gap").mkdir()
    (out / "gap" / "drive.gap.json").write_text(gap_to_json(gap), encoding="utf-8")
    (out / "gap" / "other.gap.json").write_text("{", encoding="utf-8")
    write_reports(store_at(out), fleet, [])
    after = (out / "report.html").read_text(encoding="utf-8")
    assert "viscous_drag" in page_reader.checked(after).text
    assert "viscous_drag" not in page_reader.checked(before).text
    assert page.stat().st_mtime_ns == stamp


def test_robots_by_wheel_speeds_have_the_trend_of_their_scale_and_none_of_alpha(page_reader):
    scales = (1.02, 1.021, 1.019, 1.02, 1.06)
    wheels = [
        FleetLog(row(k, None, wheel_scale=scale, wheel_scale_sd=0.001)) for k, scale in enumerate(scales)
    ]
    read = page_reader.checked(fleet_page(wheels, TOTAL, "fleet"))
    drawn = read.figures()["data"]
    assert drawn["trend_wheel_scale"]["c"].count("#d55e00") == 1
    assert "trend_alpha" not in drawn
    assert "wheel scale" in read.text
