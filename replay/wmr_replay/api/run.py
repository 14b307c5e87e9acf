"""Replaying a log: from a file or URL, or from signals in memory."""

from typing import Unpack

from wmr_replay.api.places import LocalPlace, Place, local_path, place_of
from wmr_replay.api.request import (
    Instant,
    MappingLike,
    ModelLike,
    SettingsArguments,
    between_of,
    mapping_of,
    model_of,
    settings_of,
)
from wmr_replay.api.result import Result
from wmr_replay.api.store import HINDSIGHT_SCHEMA, SampleStore
from wmr_replay.jobs.early_import import RUN_TIMELINE, import_early
from wmr_replay.jobs.owner import Claim
from wmr_replay.jobs.replay import MemorySource, Progress, Replay
from wmr_replay.jobs.result_files import Live
from wmr_replay.jobs.run import RunResult, replay_of, run_into
from wmr_replay.pipeline.engine import Engine
from wmr_replay.pipeline.memory import has_wheels_alone
from wmr_replay.pipeline.model_effects import replay_model
from wmr_schemas.model_file import Model
from wmr_schemas.signals import Log


def run(
    log: Place,
    out: LocalPlace | None = None,
    *,
    model: ModelLike | None = None,
    mapping: MappingLike | None = None,
    start: Instant | None = None,
    end: Instant | None = None,
    timeline: bool = True,
    report: bool = False,
    strict: bool = False,
    force: bool = False,
    progress: Progress | None = None,
    live: Live | None = None,
    **settings: Unpack[SettingsArguments],
) -> Result:
    """Identify contact modes and α in a log.

    Without ``out`` nothing is written where the program runs: the result is in memory, a long log's samples
    in a temporary file that goes with the result.

    Args:
        log: An MCAP file, a ROS bag (``.db3``, ``.bag``), a rosbag2 directory, or a URL.
        out: Directory for the result files, which appear together or not at all.
        model: Model or model file: parameters and effects beyond the base model.
        mapping: Mapping or mapping file: which topics hold pose, torques and truth; the robot's parameters.
        start: Leave out what was logged before: seconds from the first message, or an absolute time.
        end: Leave out what was logged after.
        timeline: Whether ``out`` receives a Rerun timeline too.
        report: Whether ``out`` receives a report too, one HTML file (extra ``report``).
        strict: Raise when something in the file was damaged.
        force: Replace results of another log of the same name in ``out``.
        progress: Called with bytes read and bytes in all.
        live: Address of a viewer (``view()``, ``serve().address``) that shows the timeline while the log is
            read, or what opens one and gives its address; with ``out`` alone.
        **settings: Fields of ``wmr_replay.Settings``, such as ``identifier="paper"`` or ``window_s=0.4``.

    Raises:
        LogUnusable: The log cannot be analysed; the message says what to try.
        InvalidSetting: A setting or model that makes no sense, or ``out`` holds results of another log.
        InvalidFile: A model or mapping file with a mistake in it.
    """
    place, claim, replaces = place_of(log), None, False
    if out is not None:
        claim = Claim.of(local_path(out), place)
        replaces = claim.settled(force=force)
        if timeline:
            import_early(RUN_TIMELINE)
    replayed = replay_of(
        place,
        settings=settings_of(settings),
        mapping=mapping_of(mapping),
        between=between_of(start, end),
        model=model_of(model),
    )
    if claim is None:
        return held_result(replayed, progress, strict=strict)
    written = run_into(
        replayed,
        claim.directory,
        timeline=timeline,
        report=report,
        strict=strict,
        progress=progress,
        live=live,
    )
    if replaces:
        claim.remove_others(written.files.values())
    return stored_result(replayed, written)


def replay(
    log: Log, *, model: ModelLike | None = None, name: str = "log", **settings: Unpack[SettingsArguments]
) -> Result:
    """Identify contact modes and α in signals that are in memory.

    Args:
        log: Pose, and torques, truth and nominal parameters where there are any.
        model: Model or model file: parameters and effects beyond the base model.
        name: What the summary and saved files call the log.
        **settings: Fields of ``wmr_replay.Settings``.

    Raises:
        InvalidSetting: A setting or model that makes no sense.
    """
    replayed = replay_model(model_of(model) or Model(), log.robot)
    engine = Engine(settings_of(settings), replayed, wheels_alone=has_wheels_alone(log))
    return held_result(Replay(MemorySource(log, name), engine))


def stored_result(replayed: Replay, written: RunResult) -> Result:
    """The result of a replay whose rows lie in files."""
    files, later = written.files, None
    store = SampleStore.of_file(files["samples"])
    if "hindsight" in files:
        later = SampleStore.of_file(files["hindsight"], HINDSIGHT_SCHEMA)
    facts = replayed.timeline_facts()
    return Result(replayed.source.stem, store, written.tables, facts, files, hindsight=later)


def held_result(replayed: Replay, progress: Progress | None = None, *, strict: bool = False) -> Result:
    """Run a replay to its end, and keep its tables."""
    store = SampleStore()
    for samples in replayed.samples(progress, strict=strict):
        store.push(samples)
    store.finish()
    later = SampleStore(schema=HINDSIGHT_SCHEMA)
    for rows in replayed.hindsight():
        later.push(rows)
    later.finish()
    facts = replayed.timeline_facts()
    return Result(replayed.source.stem, store, replayed.tables(), facts, hindsight=later)
