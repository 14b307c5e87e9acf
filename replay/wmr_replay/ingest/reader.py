"""A log as bounded batches of columns in file order: the one entrance to ingest."""

import hashlib
import shutil
import tempfile
import weakref
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from wmr_replay.ingest.between import Between
from wmr_replay.ingest.budgets import Allowance
from wmr_replay.ingest.channels.candidate import Candidate
from wmr_replay.ingest.channels.clocks import Clock
from wmr_replay.ingest.channels.detect import Plan, detect, not_found
from wmr_replay.ingest.channels.unsupported_robots import unsupported_kinds
from wmr_replay.ingest.losses import Losses
from wmr_replay.ingest.mcap.chunk_selection import first_log_ns, wanted_spans
from wmr_replay.ingest.mcap.log_files import join_files
from wmr_replay.ingest.mcap.message_counts import MessageCounts
from wmr_replay.ingest.mcap.prefetch import work_ahead
from wmr_replay.ingest.mcap.remote import readable_file, update_identity
from wmr_replay.ingest.own_parameters import own_parameters
from wmr_replay.ingest.reading import Reading
from wmr_replay.ingest.storage.bag import bag_files, plain_file
from wmr_replay.ingest.storage.file_check import unreadable
from wmr_replay.ingest.storage.source import LogPath, RemotePath, size_of
from wmr_schemas.batches import RawBatch, Rows
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.messages import METADATA_NAME
from wmr_schemas.robot import RobotParameters

_HASH_BYTES = 1 << 20
_PIECE_ROWS = 1 << 16
"""Rows of all signals in one batch. Memory: some hundred bytes are made of each."""
NO_MAPPING = LogMapping()
WHOLE = Between()


class LogReader:
    """A log whose channels in use are known. Made by :func:`open_log`.

    ``plan`` says which channel is the pose, the torque and the true mode, and why the others are not.
    ``robot`` holds the nominal parameters: the mapping's, else the log's own. ``losses``, ``message_counts``
    and ``remarks`` are complete once :meth:`batches` is exhausted.
    """

    def __init__(self, path: LogPath, mapping: LogMapping, between: Between = WHOLE) -> None:
        self.path = path
        self._copies: Path | None = None
        nearer = [readable_file(file, self._folder) for file in bag_files(path)]
        files = [plain_file(file, self._folder) for file, _ in nearer]
        self.files = join_files([file for file, _ in files])
        self.survey = self.files.survey
        self.survey.notes += [problem for _, problem in files if problem]
        self.limits = between.limits_ns(first_log_ns(self.survey))
        self.candidates = self._candidates()
        self.plan: Plan = detect(path, self.candidates, mapping)
        self.remarks: list[str] = unsupported_kinds(self.candidates)
        self.remarks += [remark for _, remark in nearer if remark]
        self.robot = mapping.robot or self._own_parameters()
        self.clocks: dict[str, Clock] = {}
        self.losses = self._frame_losses()
        self.message_counts = MessageCounts()
        self.position_bytes = 0

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
    def pose_is_odometry(self) -> bool:
        """Whether the pose may well have been integrated from wheel speeds, by its name."""
        return self.plan.pose_is_odometry

    @property
    def stamp_notes(self) -> list[str]:
        """Irregular stamps of pose and torque: duplicates, backward steps, gaps, jitter.

        The truth is stamped when it changes, so its steps mean nothing.
        """
        found = ((role, clock.steps.describe()) for role, clock in self.clocks.items() if role != "truth")
        return [f"{self.plan.uses[role].channel.topic}: {text}" for role, text in found if text]

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
        self.clocks = {role: Clock.choose(use) for role, use in self.plan.uses.items()}
        reading = Reading(self.plan.uses, self.clocks, self.files, self.losses, self.limits)
        used = {use.channel.id for use in self.plan.uses.values()}
        spans = wanted_spans(self.survey, None if everything else used, self.limits)
        before = self._bytes_before()
        for group in work_ahead(self.files.paths, spans, reading.begin):
            batch, span = reading.push(group), group.last
            self.position_bytes = before[span.file_index] + span.data_offset + span.data_bytes
            yield from pieces(batch)
        self.message_counts = reading.message_counts
        whole = len(spans) == len(self.survey.spans) and self.limits is None
        statistics = self.survey.statistics if whole else None
        reading.finish(None if statistics is None else sum(statistics.values()))
        self.remarks += reading.remarks
        self.position_bytes = self.size_bytes

    def _bytes_before(self) -> list[int]:
        """How many bytes precede each file."""
        sizes = [size_of(path) for path in self.files.paths]
        return [sum(sizes[:k]) for k in range(len(sizes))]

    def _frame_losses(self) -> Losses:
        """Losses that the survey has found, before any chunk is read."""
        found = self.survey
        return Losses(
            n_chunks_damaged=found.n_chunks_damaged, truncated=found.truncated, notes=list(found.notes)
        )

    def _own_parameters(self) -> RobotParameters:
        """Parameters of the log's metadata record; a remark about each that makes no sense."""
        robot, notes = own_parameters(self.survey.metadata.get(METADATA_NAME, {}))
        self.remarks += notes
        return robot


def pieces(batch: RawBatch) -> Iterator[RawBatch]:
    """A batch by parts that follow each other in the file, so that what is made of a part fits in memory."""
    signals = (batch.pose, batch.torque, batch.mode)
    if max(map(len, signals)) <= _PIECE_ROWS:
        yield batch
        return
    orders = np.sort(np.concatenate([rows.order for rows in signals]))
    cuts = [*orders[_PIECE_ROWS::_PIECE_ROWS].tolist(), int(orders[-1]) + 1]
    before = [0, 0, 0]
    for cut in cuts:
        after = [int(np.searchsorted(rows.order, cut)) for rows in signals]
        yield RawBatch(
            *(between(rows, slice(a, b)) for rows, a, b in zip(signals, before, after, strict=True))
        )
        before = after


def between(rows: Rows, part: slice) -> Rows:
    """Consecutive rows of a slice, as a view."""
    return Rows(rows.t_ns[part], rows.order[part], rows.values[:, part])


def open_log(
    path: LogPath, mapping: LogMapping = NO_MAPPING, *, need_pose: bool = True, between: Between = WHOLE
) -> LogReader:
    """Open an MCAP log, or a rosbag2 directory of them, and find its signals.

    ``between`` leaves out what was logged before or after. Raises LogUnusable when it is no MCAP file,
    ChannelNotFound when it has no pose (unless ``need_pose`` is
    false) or when a topic that ``mapping`` names does not serve.
    """
    try:
        reader = LogReader(path, mapping, between)
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
