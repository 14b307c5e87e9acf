"""``wmr-replay batch``: one dataset of many logs, independent of workers and of restarts."""

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import polars as pl
import pyarrow.dataset as ds
import pytest
from polars.testing import assert_frame_equal

from wmr_replay.fleet.batch import do_all, run_batch
from wmr_replay.fleet.dataset import TABLES, part_name
from wmr_replay.fleet.job import Orders, make_job, partition_key
from wmr_replay.fleet.pool import Died, Pool
from wmr_replay.fleet.stores import Directory
from wmr_replay.fleet.summary import totals
from wmr_replay.fleet.worklist import find_logs
from wmr_replay.jobs.run import run_log
from wmr_replay.pipeline.settings import Settings
from wmr_schemas.errors import InvalidSetting, LogUnusable
from wmr_schemas.model_file import Model

pytestmark = pytest.mark.timeout(300)
BINARY = Path(sys.executable).with_name("wmr-replay")


class Here:
    """Workers that are this process itself."""

    def map(self, function, tasks):
        yield from enumerate(function(*task) for task in tasks)


def batch_here(logs, out, orders=None):
    store = Directory(out)
    with store.opened():
        return do_all(Here(), find_logs(logs), orders or Orders(), store, None)


def content(folder):
    """Every file's bytes by name."""
    files = (path for path in folder.rglob("*") if path.is_file() and path.name != ".lock")
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


def assert_whole(folder):
    """Every completion record tells the truth about every file that it lists."""
    records = sorted((folder / "records").glob("*.json"))
    for path in records:
        files = json.loads(path.read_text())["files"]
        assert len(files) >= 3
        for name, facts in files.items():
            assert hashlib.sha256((folder / name).read_bytes()).hexdigest() == facts["sha256"], name
    return len(records)


@pytest.fixture(scope="module")
def logs(short_logs, tmp_path_factory):
    """The short logs and a file that is none."""
    folder = tmp_path_factory.mktemp("with-bad") / "logs"
    shutil.copytree(short_logs, folder)
    (folder / "bad.mcap").write_text("no log at all")
    return folder


@pytest.fixture(scope="module")
def dataset(logs, tmp_path_factory):
    """What the command makes of them with two processes."""
    out = tmp_path_factory.mktemp("fleet") / "out"
    command = [BINARY, "batch", logs, "--out", out, "--jobs", "2"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return out, done


def test_the_dataset_holds_what_run_gives_for_each_log(logs, dataset, tmp_path):
    out, _ = dataset
    whole = {name: pl.scan_parquet(out / name, hive_partitioning=True).collect() for name in TABLES}
    assert {frame["log"].n_unique() for frame in whole.values()} == {3}
    for log in find_logs([logs / "a.mcap", logs / "below"]):
        result = run_log(log, tmp_path / log.stem, timeline=False)
        key = partition_key(log, hashlib.sha256(log.read_bytes()).hexdigest())
        for name, frame in whole.items():
            alone = pl.read_parquet(result.files[name])
            alone = alone.rename({"log": "path"}) if name == "summary" else alone
            assert_frame_equal(frame.filter(pl.col("log") == key).drop("log"), alone)


def test_without_hindsight_its_tables_of_an_earlier_batch_go(logs, tmp_path):
    (outcome,) = batch_here([logs / "a.mcap"], tmp_path)
    later = [tmp_path / part_name(table, outcome.key) for table in ("hindsight", "hindsight_segments")]
    assert all(file.is_file() for file in later)
    batch_here([logs / "a.mcap"], tmp_path, Orders(Settings(hindsight=False)))
    assert not any(file.exists() for file in later)
    assert assert_whole(tmp_path) == 1
    samples = pl.scan_parquet(tmp_path / "samples", hive_partitioning=True).collect()
    assert set(samples["log"]) == {outcome.key}


def test_pyarrow_reads_the_same_dataset(dataset):
    for name in TABLES:
        table = ds.dataset(dataset[0] / name, partitioning="hive").to_table()
        frame = pl.read_parquet(dataset[0] / name, hive_partitioning=True)
        assert table.num_rows == len(frame) > 0
        assert set(table.column_names) == set(frame.columns)
        assert set(table["log"].to_pylist()) == set(frame["log"])


def test_one_failing_log_is_told_like_run_tells_it_and_stops_no_other(logs, dataset):
    out, done = dataset
    with pytest.raises(LogUnusable) as error:
        run_log(logs / "bad.mcap", out.parent / "none")
    assert done.returncode == 1, done.stderr
    fleet = json.loads((out / "fleet.json").read_text())
    assert [row["problem"] for row in fleet["logs"] if row["state"] == "failed"] == [str(error.value)]
    assert (fleet["totals"]["n_done"], fleet["totals"]["n_failed"]) == (3, 1)
    for line in str(error.value).splitlines():
        assert line in done.stdout
    assert "Traceback" not in done.stderr
    assert done.stderr.count("done: ") == 3


def test_results_do_not_depend_on_who_works(logs, dataset, tmp_path):
    """Two processes, one process, and this one, with the logs in another order: the same bytes."""
    one = tmp_path / "one"
    words = [logs / "bad.mcap", logs / "below", logs / "b.mcap", logs / "a.mcap"]
    run_batch(words, one, Orders(), n_jobs=1)
    assert content(one) == content(dataset[0])
    batch_here(words, tmp_path / "here")
    assert content(tmp_path / "here").items() <= content(one).items()
    assert len(content(tmp_path / "here")) == len(content(one)) - 2


def test_what_is_done_is_skipped_until_content_settings_or_files_change(logs, tmp_path):
    log, out = tmp_path / "a.mcap", tmp_path / "out"
    shutil.copy(logs / "a.mcap", log)

    def again(orders=None):
        (outcome,) = batch_here([log], out, orders)
        assert not outcome.problem
        return not outcome.skipped

    assert again()
    assert not again()
    other = Orders(Settings(degree=3))
    assert again(other)
    assert not again(other)
    assert again()
    next((out / "samples").rglob("*.parquet")).unlink()
    assert again()
    assert not again()
    (tmp_path / "a.truth.json").write_text((logs / "b.truth.json").read_text())
    assert again()
    shutil.copy(logs / "b.mcap", log)
    assert again()
    assert assert_whole(out) == 2


def test_equal_names_do_not_collide_and_equal_logs_are_done_once(logs, tmp_path):
    (tmp_path / "x").mkdir()
    (tmp_path / "y").mkdir()
    first, other, copy = tmp_path / "x" / "a.mcap", tmp_path / "y" / "a.mcap", tmp_path / "copy.mcap"
    shutil.copy(logs / "a.mcap", first)
    shutil.copy(logs / "b.mcap", other)
    shutil.copy(first, copy)
    outcomes = batch_here([first, other, first, copy, tmp_path / "x"], tmp_path / "out")
    assert [Path(outcome.log).name for outcome in outcomes] == ["a.mcap", "a.mcap", "copy.mcap"]
    assert outcomes[2].same_as == str(first)
    samples = pl.read_parquet(tmp_path / "out" / "samples", hive_partitioning=True)
    keys = {outcomes[0].key, outcomes[1].key}
    assert len(keys) == 2
    assert set(samples["log"]) == keys


def test_a_crash_before_any_step_of_storing_leaves_no_record_of_half_a_result(logs, tmp_path):
    """An older result of the same log is there, so that old and new files might be mixed up."""

    class Crash(BaseException):
        pass

    class Fragile(Directory):
        steps = 0

        def step(self):
            self.steps -= 1
            if not self.steps:
                raise Crash

        def put(self, file, name):
            self.step()
            super().put(file, name)

        def remove(self, name):
            self.step()
            super().remove(name)

    from wmr_replay.fleet.dataset import replay_into

    old, new = (make_job(logs / "a.mcap", Orders(Settings(degree=degree))) for degree in (2, 3))
    n_crashes = 0
    for steps in range(1, 40):
        store = Fragile(tmp_path / str(steps))
        with store.opened():
            replay_into(store, old)
            store.steps = steps
            try:
                replay_into(store, new)
            except Crash:
                n_crashes += 1
                assert assert_whole(store.place) <= 1
                assert all(store.record(key)["task"] == old.task for key in store.done())
            else:
                break
    assert n_crashes >= 10
    assert assert_whole(store.place) == 1
    assert store.record(new.key)["task"] == new.task


def test_only_one_batch_at_a_time_writes_to_a_directory(logs, tmp_path):
    with Directory(tmp_path).opened(), pytest.raises(InvalidSetting, match="another batch"):
        run_batch([logs], tmp_path, Orders())


def test_stale_temporaries_are_cleaned(tmp_path):
    store = Directory(tmp_path)
    (tmp_path / ".partial" / "killed").mkdir(parents=True)
    with store.opened():
        assert not (tmp_path / ".partial").exists()


def test_a_worker_that_dies_takes_only_its_own_task_with_it():
    with Pool(2) as pool:
        found = dict(pool.map(len, [("ab",), (b"c",)]))
        assert found == {0: 2, 1: 1}
        assert dict(pool.map(pl.thread_pool_size, [()])) == {0: 1}
        results = dict(pool.map(os._exit, [(7,), (9,)]))
        assert results == {0: Died(7), 1: Died(9)}
        mixed = dict(pool.map(signal.raise_signal, [(signal.SIGKILL,), (signal.SIGCONT,)]))
        assert mixed == {0: Died(-signal.SIGKILL), 1: None}
        assert "memory" in str(mixed[0])
        assert dict(pool.map(len, [("abc",)])) == {0: 3}


def test_logs_are_found_by_file_folder_bag_and_pattern(tmp_path):
    bag = tmp_path / "day" / "bag"
    bag.mkdir(parents=True)
    for path in (
        bag / "bag_0.mcap",
        bag / "metadata.yaml",
        tmp_path / "day" / "x.mcap",
        tmp_path / "y.mcap.zst",
    ):
        path.touch()
    (tmp_path / "notes.txt").touch()
    (tmp_path / ".hidden").mkdir()
    (tmp_path / ".hidden" / "h.mcap").touch()
    everything = [bag, tmp_path / "day" / "x.mcap", tmp_path / "y.mcap.zst"]
    assert find_logs([tmp_path]) == everything
    assert find_logs([tmp_path / "*"]) == everything
    assert find_logs([tmp_path / "**" / "x.mcap", tmp_path / "day"]) == [everything[1], bag]
    assert find_logs([tmp_path / "gone.mcap"]) == [tmp_path / "gone.mcap"]
    with pytest.raises(InvalidSetting, match=r"none\*"):
        find_logs([tmp_path / "none*"])
    (tmp_path / "empty").mkdir()
    with pytest.raises(InvalidSetting, match="no log"):
        find_logs([tmp_path / "empty"])


def test_totals_weigh_by_time():
    fleet = pl.DataFrame(
        {
            "state": ["done", "done", "failed"],
            "duration_s": [1800.0, 5400.0, None],
            "accuracy": [None, 0.75, None],
            "share_ideal": [1.0, 0.5, None],
            **{
                f"share_{name}": [0.0, 0.125, None]
                for name in ("skidding", "slipping", "skidding_slipping", "undecided")
            },
        }
    )
    found = totals(fleet)
    assert (found["n_done"], found["n_failed"], found["hours"]) == (2, 1, 2.0)
    assert found["share_ideal"] == 0.625
    assert found["accuracy"] == 0.75
    assert found["n_with_truth"] == 1


def test_orders_differ_by_everything_that_decides_results():
    some = [Orders(), Orders(Settings(degree=3)), Orders(strict=True)]
    texts = {orders.as_text() for orders in some}
    assert len(texts) == len(some)
    assert Orders(timeline=True).as_text() == Orders().as_text()
    assert Orders(model=Model()).as_text() == Orders().as_text()


def test_timelines_are_written_when_asked_for(logs, tmp_path):
    (outcome,) = batch_here([logs / "a.mcap"], tmp_path, Orders(timeline=True))
    assert (tmp_path / "timelines" / f"{outcome.key}.rrd").stat().st_size > 1000
    assert assert_whole(tmp_path) == 1


def test_a_later_batch_without_timelines_neither_redoes_nor_removes_them(logs, tmp_path):
    one = [logs / "a.mcap"]
    (first,) = batch_here(one, tmp_path, Orders(timeline=True))
    before = content(tmp_path)
    (again,) = batch_here(one, tmp_path, Orders())
    assert (first.skipped, again.skipped) == (False, True)
    assert content(tmp_path) == before


def test_a_later_batch_with_timelines_makes_those_that_are_missing(logs, tmp_path):
    one = [logs / "a.mcap"]
    (first,) = batch_here(one, tmp_path)
    (again,) = batch_here(one, tmp_path, Orders(timeline=True))
    (last,) = batch_here(one, tmp_path, Orders(timeline=True))
    assert [outcome.skipped for outcome in (first, again, last)] == [False, False, True]
    assert (tmp_path / "timelines" / f"{first.key}.rrd").is_file()


def test_other_settings_leave_no_timeline_of_the_old_ones(logs, tmp_path):
    one = [logs / "a.mcap"]
    batch_here(one, tmp_path, Orders(timeline=True))
    (other,) = batch_here(one, tmp_path, Orders(Settings(identifier="paper")))
    assert not other.skipped
    assert list((tmp_path / "timelines").iterdir()) == []
