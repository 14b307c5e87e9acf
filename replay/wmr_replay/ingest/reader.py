"""A log as bounded batches of columns in file order: the one entrance to ingest."""

import hashlib
import shutil
import tempfile
import weakref
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from wmr_replay.ingest.bags.container import container_of
from wmr_replay.ingest.between import Between, check_overlap, nothing_between
from wmr_replay.ingest.budgets import Allowance
from wmr_replay.ingest.channels.candidate import Candidate
from wmr_replay.ingest.channels.clocks import Clock
from wmr_replay.ingest.channels.clocks_apart import apart_from_pose, choose_clocks
from wmr_replay.ingest.channels.detect import Plan, Use, detect, not_found
from wmr_replay.ingest.channels.planarity import CODE as PLANARITY
from wmr_replay.ingest.channels.stamp_unit import log_time_findings, stamp_unit_findings
from wmr_replay.ingest.channels.unreadable import unreadable_kin, without_schema
from wmr_replay.ingest.channels.unsupported_robots import drive_findings
from wmr_replay.ingest.channels.wheel_bindings import made_up
from wmr_replay.ingest.channels.wheel_channels import find_wheel_channels, held_by
from wmr_replay.ingest.losses import Losses
from wmr_replay.ingest.mcap.checksums import NO_CHECKSUMS, is_covered
from wmr_replay.ingest.mcap.chunk_selection import (
    are_timed,
    index_adds_up,
    kinds_of,
    log_span_ns,
    wanted_spans,
)
from wmr_replay.ingest.mcap.chunks import Span
from wmr_replay.ingest.mcap.log_files import join_files
from wmr_replay.ingest.mcap.message_counts import MessageCounts
from wmr_replay.ingest.mcap.prefetch import work_ahead
from wmr_replay.ingest.mcap.remote import readable_file, update_identity
from wmr_replay.ingest.mcap.stretches import stretches
from wmr_replay.ingest.own_parameters import own_parameters
from wmr_replay.ingest.reading import Reading, joined
from wmr_replay.ingest.storage.bag import bag_files, plain_file
from wmr_replay.ingest.storage.file_check import unreadable
from wmr_replay.ingest.storage.source import LogPath, RemotePath
from wmr_schemas.batches import Bar, RawBatch, Rows
from wmr_schemas.errors import LogUnusable
from wmr_schemas.findings import KINDS, Finding, Severity
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.messages import METADATA_NAME

_HASH_BYTES = 1 << 20
_PIECE_ROWS = 1 << 16
"""Rows of all signals in one batch. Memory: some hundred bytes are made of each."""
NO_MAPPING = LogMapping()
WHOLE = Between()
EARLIEST_NS = -(2**63)
MAIN_ROLES = ("pose", "torque", "truth")
"""What a replay reads."""


class LogReader:
    """A log whose channels in use are known. Made by :func:`open_log`.

    ``plan`` says which channel is the pose, the torque and the true mode, and why the others are not.
    ``robot`` holds the nominal parameters: the log's own, overridden key by key by the mapping's; and those
    that were made up for a twist, which ``known_robot`` lacks.
    ``losses``, ``message_counts``, ``remarks`` and ``findings`` are complete once :meth:`batches` is
    exhausted.
    """

    def __init__(
        self,
        path: LogPath,
        mapping: LogMapping,
        between: Between = WHOLE,
        *,
        by_index: bool = False,
        also: Sequence[str] = (),
    ) -> None:
        self.path, self._roles = path, (*MAIN_ROLES, *also)
        self._copies: Path | None = None
        self._in_part = by_index
        nearer = [readable_file(file, self._folder) for file in bag_files(path)]
        files = [plain_file(file, self._folder) for file, _ in nearer]
        self.files = join_files([container_of(file) or file for file, _ in files], by_index=by_index)
        self.survey = self.files.survey
        self.survey.notes += [problem for _, problem in files if problem]
        self.between, self.span_ns = between, log_span_ns(self.survey)
        self.limits = between.limits_ns(self.span_ns)
        if self.span_ns[0] < self.span_ns[1] and are_timed(self.survey.spans):
            check_overlap(path, between, self.limits, self.span_ns)
        self.candidates = self._candidates()
        self.plan: Plan = detect(path, self.candidates, mapping)
        metadata = self.survey.metadata.get(METADATA_NAME, {}) if mapping.robot_from_log else {}
        own, without_sense = own_parameters(metadata)
        self.robot = self.known_robot = own.overridden_by(mapping.robot)
        find_wheel_channels(path, self.plan, self.candidates, replace(mapping, robot=self.robot))
        self.remarks: list[str] = [remark for _, remark in nearer if remark]
        self.remarks += without_schema(self.candidates) + unreadable_kin(self.candidates, self.plan.uses)
        self.remarks += self._make_up_wheels()
        self.findings: list[Finding] = [*without_sense, *drive_findings(self.candidates, mapping)]
        self.clocks: dict[str, Clock] = {}
        self.losses = self._frame_losses()
        self.message_counts = MessageCounts()
        self.position_bytes = 0

    @property
    def uses(self) -> dict[str, Use]:
        """The channels that are read, by role."""
        return {role: use for role, use in self.plan.uses.items() if role in self._roles}

    def _make_up_wheels(self) -> list[str]:
        """Give the robot the wheels by which a twist became wheel speeds, where it has none; and say so."""
        use = self.plan.uses.get("torque")
        values = {} if use is None else made_up(use.binding)
        if use is None or not values:
            return []
        self.robot = replace(self.robot, **values)
        said = ", ".join(f"{name} {value:g}" for name, value in values.items())
        return [f"{use.channel.topic}: turned into wheel speeds with {said}, which is made up"]

    def _folder(self) -> Path:
        """The folder into which packed files are unpacked; it is removed with the reader."""
        if self._copies is None:
            self._copies = Path(tempfile.mkdtemp(prefix="wmr-replay-"))
            weakref.finalize(self, shutil.rmtree, self._copies, ignore_errors=True)
        return self._copies

    def _candidates(self) -> list[Candidate]:
        """All channels with their schemas and first messages, by id."""
        catalogue, parts = self.survey.catalogue, self.files
        self._allowance = Allowance(self.survey.size_bytes)
        return [
            Candidate(
                channel,
                catalogue.schemas.get(channel.schema_id),
                tuple(parts.samples.get(channel_id, ())),
                parts.n_messages.get(channel_id, 0),
                self._allowance,
            )
            for channel_id, channel in sorted(catalogue.channels.items())
        ]

    @property
    def size_bytes(self) -> int:
        """Size in bytes of all files of the log."""
        return self.survey.size_bytes

    @property
    def has_checksums(self) -> bool:
        """Whether a checksum covers any message of the log; true of a log without messages."""
        _, crc = self.survey.data_end or (0, 0)
        return bool(crc) or not self.survey.spans or any(map(is_covered, kinds_of(self.survey.spans)))

    @property
    def pose_is_odometry(self) -> bool:
        """Whether the pose may well have been integrated from wheel speeds, by its name."""
        return self.plan.pose_is_odometry

    @property
    def stamp_notes(self) -> list[str]:
        """Irregular stamps of pose and torque: duplicates, backward steps, gaps, jitter.

        The truth is stamped when it changes, so its steps mean nothing.
        """
        found = ((role, clock.steps.describe()) for role, clock in self.clocks.items() if role != "truth")
        notes = (f"{self.plan.uses[role].channel.topic}: {text}" for role, text in found if text)
        return list(dict.fromkeys(notes))

    @property
    def clock_notes(self) -> list[str]:
        """Which clock each channel goes by, and how far it is from the recorder's."""
        return [
            f"{self.plan.uses[role].channel.topic}: {clock.describe()}" for role, clock in self.clocks.items()
        ]

    def batches(self, *, everything: bool = False) -> Iterator[RawBatch]:
        """Rows of the channels in use in file order, a batch for a few neighbouring chunks.

        With ``everything``, chunks that hold none of them are read too, to count their messages and losses.
        """
        self.losses = self._frame_losses()
        self._allowance.begin_pass()
        self._choose_clocks()
        reading = Reading(self.uses, self.clocks, self.files, self.losses, self.limits)
        used = {use.channel.id for use in self.uses.values()}
        spans = wanted_spans(self.survey, None if everything else used, self.limits)
        before, bars = self._bytes_before(), self._first_bars()
        self.files.want(used)
        for group in work_ahead(self.files.paths, spans, reading.begin):
            batch, span = reading.push(group), group.last
            self.position_bytes = before[span.file_index] + span.data_offset + span.data_bytes
            yield from pieces(replace(batch, bars=(*bars, *batch.bars)) if bars else batch)
            bars = ()
        self.message_counts = reading.message_counts
        whole = len(spans) == len(self.survey.spans) and self.limits is None
        reading.finish(self.survey.statistics if whole else None)
        self.remarks += reading.remarks
        if self.losses.any() and not self.has_checksums:
            self.remarks.append(NO_CHECKSUMS)
        self.findings = [f for f in self.findings if f.code != PLANARITY] + reading.planarity.findings()
        self.findings += reading.clock_steps.findings() if reading.clock_steps else []
        self.position_bytes = self.size_bytes

    def _choose_clocks(self) -> None:
        """The clock of each channel in use, and what is to be said about clocks that are apart."""
        self.clocks, apart = choose_clocks(self.uses)
        for role in apart_from_pose(self.uses, self.clocks):
            self._leave_out(role, "its stamps are seconds off the pose's: --clock log may help")
        reasons = {self.plan.uses[role].channel.topic: clock.reason for role, clock in self.clocks.items()}
        before = [found for found in self.findings if found.code not in {"clocks_apart", "stamp_unit"}]
        units = {self.plan.uses[role].channel.topic: clock.log_unit for role, clock in self.clocks.items()}
        self.findings = [*before, *apart, *stamp_unit_findings(reasons), *log_time_findings(units)]

    def _leave_out(self, role: str, reason: str) -> None:
        """Use a channel no longer."""
        channel_id = self.plan.uses.pop(role).channel.id
        self.clocks.pop(role)
        self.plan.lacks[role, channel_id] = self.plan.why_not[channel_id] = reason

    def nothing_between(self, what: str) -> LogUnusable:
        """The error for limits within which no result can be made of the log; ``what`` says why."""
        return nothing_between(self.path, self.between, self.span_ns, what)

    @property
    def is_by_index(self) -> bool:
        """Whether the file between the chunks of its index, or most of a table's rows, are unseen, though
        they could be seen.
        """
        unseen = self.survey.by_rows and self._in_part
        return isinstance(self.path, Path) and (
            unseen or any(span.by_index for span in kinds_of(self.survey.spans))
        )

    def stretches(self) -> list[list[Span]] | None:
        """The spans of a few stretches that stand for the log; None where all of it has to be read.

        That is so for a log without an index that adds up or rows that are numbered, and for one that is
        small.
        """
        by_rows = self.survey.by_rows and self.limits is None
        if not by_rows and not index_adds_up(self.survey):
            return None
        used = {use.channel.id for use in self.uses.values()}
        spans = wanted_spans(self.survey, used or None, self.limits)
        chosen = stretches(spans)
        is_whole = sum(map(len, chosen)) == len(wanted_spans(self.survey, None, self.limits))
        return None if is_whole else chosen

    def sampled_batches(self, chosen: list[list[Span]]) -> Iterator[RawBatch]:
        """Rows of the channels in use, a batch for each of the stretches of :meth:`stretches`.

        The rows of a stretch follow one another in the file; between two stretches, rows are missing.
        ``losses``, ``message_counts`` and ``clocks`` are of what was read.
        """
        self.losses, self.message_counts = self._frame_losses(), MessageCounts()
        self._choose_clocks()
        self.findings = [f for f in self.findings if f.code != PLANARITY]
        self.files.want({use.channel.id for use in self.uses.values()})
        for spans in chosen:
            for clock in self.clocks.values():
                clock.steps.restart()
            reading = Reading(self.uses, self.clocks, self.files, self.losses, self.limits)
            yield joined([reading.push(g) for g in work_ahead(self.files.paths, spans, reading.begin)])
            self.message_counts.add(reading.message_counts)
            reading.finish()
            known = {found.code for found in self.findings}
            self.findings += [found for found in reading.planarity.findings() if found.code not in known]
            self.remarks += [remark for remark in reading.remarks if remark not in self.remarks]

    def _first_bars(self) -> tuple[Bar, ...]:
        """What names alone bar, from the first row on."""
        status = KINDS["drives_sideways"].bars
        barred = any(f.code == "drives_sideways" and f.severity == Severity.BARS for f in self.findings)
        return (Bar("drives_sideways", EARLIEST_NS, status),) if barred and status is not None else ()

    @property
    def is_steered(self) -> bool:
        """Whether names say that the robot is steered: its efforts tell nothing of slipping."""
        return any(f.code == "steered" and f.severity == Severity.WARNING for f in self.findings)

    @property
    def has_wheels_alone(self) -> bool:
        """Whether the first messages of the channel in use for torques hold wheel speeds alone."""
        torque = self.plan.uses.get("torque")
        efforts, speeds = (False, False) if torque is None else held_by(torque)
        return speeds and not efforts

    def _bytes_before(self) -> list[int]:
        """How many bytes precede each file."""
        sizes = self.files.sizes()
        return [sum(sizes[:k]) for k in range(len(sizes))]

    def _frame_losses(self) -> Losses:
        """Losses that the survey has found, before any chunk is read."""
        found = self.survey
        return Losses(
            n_chunks_damaged=found.n_chunks_damaged, truncated=found.truncated, notes=list(found.notes)
        )


def pieces(batch: RawBatch) -> Iterator[RawBatch]:
    """A batch by parts that follow each other in the file, so that what is made of a part fits in memory."""
    signals = (batch.pose, batch.torque, batch.mode, batch.wheels, batch.command)
    if max(map(len, signals)) <= _PIECE_ROWS:
        yield batch
        return
    orders = np.sort(np.concatenate([rows.order for rows in signals]))
    cuts = [*orders[_PIECE_ROWS::_PIECE_ROWS].tolist(), int(orders[-1]) + 1]
    before = [0] * len(signals)
    for cut in cuts:
        after = [int(np.searchsorted(rows.order, cut)) for rows in signals]
        parts = [between(rows, slice(a, b)) for rows, a, b in zip(signals, before, after, strict=True)]
        bars = batch.bars if cut == cuts[0] else ()
        yield RawBatch(*parts[:3], bars=bars, wheels=parts[3], command=parts[4])
        before = after


def between(rows: Rows, part: slice) -> Rows:
    """Consecutive rows of a slice, as a view."""
    return Rows(rows.t_ns[part], rows.order[part], rows.values[:, part])


def open_log(
    path: LogPath,
    mapping: LogMapping = NO_MAPPING,
    *,
    need_pose: bool = True,
    between: Between = WHOLE,
    by_index: bool = False,
    also: Sequence[str] = (),
) -> LogReader:
    """Open a log, an MCAP file, a ROS bag or a rosbag2 directory, and find its signals.

    ``between`` leaves out what was logged before or after. ``by_index``: chunks are those of the file's
    index, if it adds up, without a look at the file between them. ``also``: roles that are read besides pose,
    torque and truth: ``wheel_speed``, ``command``. Raises LogUnusable when it is no such file,
    ChannelNotFound when it has no pose (unless ``need_pose`` is false) or when a topic that ``mapping``
    names does not serve.
    """
    try:
        reader = LogReader(path, mapping, between, by_index=by_index, also=also)
    except OSError as error:
        raise unreadable(path, error) from None
    if need_pose and reader.plan.pose is None:
        raise not_found(path, "pose", reader.candidates, reader.plan)
    return reader


def sha256_of(path: LogPath) -> str:
    """Hash of a log's files, one after another, in hexadecimal; of a URL's its identity, see
    :func:`wmr_replay.ingest.mcap.remote.update_identity`.
    """
    digest = hashlib.sha256()
    for part in bag_files(path):
        if isinstance(part, RemotePath):
            update_identity(part, digest.update)
            continue
        with part.open("rb") as file:
            while piece := file.read(_HASH_BYTES):
                digest.update(piece)
    return digest.hexdigest()
