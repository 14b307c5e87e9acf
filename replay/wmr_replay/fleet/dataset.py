"""One log's results as partitions of one dataset: ``samples/log=<key>/part.parquet`` and so on."""

from pathlib import Path

import polars as pl

from wmr_replay.fleet.job import Job, as_record, file_sha256
from wmr_replay.fleet.store import PARTITION, Store, record_name, timeline_name
from wmr_replay.jobs.run import RunResult, run_log
from wmr_replay.tables import write_parquet

TABLES = ("samples", "segments", "summary", "confusion", "hindsight", "hindsight_segments")
"""Each table is a dataset of its own, so that all files of one have the same columns."""


def part_name(table: str, key: str) -> str:
    """Where a log's part of a table lies: hive style, so that readers make a column ``log`` of it."""
    return f"{table}/{PARTITION}{key}/part.parquet"


def report_name(key: str) -> str:
    """Where a log's report lies."""
    return f"reports/{key}.html"


def replay_into(store: Store, job: Job) -> None:
    """Replay a log; its files appear one by one, each whole, and its completion record last.

    Raises LogUnusable.
    """
    orders = job.orders
    with store.workshop() as folder:
        result = run_log(
            job.log,
            folder,
            settings=orders.settings,
            mapping=orders.mapping,
            between=orders.between,
            model=orders.model,
            timeline=orders.timeline,
            strict=orders.strict,
            sha256=job.sha256,
        )
        files = dataset_files(job.key, result)
        forget(store, job.key)
        facts = {}
        for name, path in sorted(files.items()):
            facts[name] = {"sha256": file_sha256(path), "size_bytes": path.stat().st_size}
            store.put(path, name)
        store.complete(as_record(job, facts))


def dataset_files(key: str, result: RunResult) -> dict[str, Path]:
    """The files of a run by their names in the dataset.

    In ``summary`` the log's path stands in the column ``path``, since ``log`` is the partition.
    """
    summary = result.files["summary"]
    write_parquet(summary, pl.read_parquet(summary, glob=False).rename({"log": "path"}))
    files = {part_name(name, key): result.files[name] for name in TABLES if name in result.files}
    return files | ({timeline_name(key): result.files["timeline"]} if "timeline" in result.files else {})


def forget(store: Store, key: str) -> None:
    """Remove an older result of the log, its completion record first."""
    store.remove(record_name(key))
    for name in (*(part_name(table, key) for table in TABLES), timeline_name(key), report_name(key)):
        store.remove(name)
