"""A log as bounded batches of columns in file order: the one entrance to ingest."""

import hashlib
from collections.abc import Iterator
from pathlib import Path

from wmr_replay.ingest.census import Census
from wmr_replay.ingest.clocks import Clock
from wmr_replay.ingest.detect import Plan, detect, not_found
from wmr_replay.ingest.entrance import check_entrance, unreadable
from wmr_replay.ingest.losses import Losses
from wmr_replay.ingest.prefetch import load_ahead
from wmr_replay.ingest.reading import Reading
from wmr_replay.ingest.roles import Candidate
from wmr_replay.ingest.sampling import Sampler
from wmr_replay.ingest.signals import RawBatch
from wmr_replay.ingest.survey import survey
from wmr_schemas.errors import InvalidFile
from wmr_schemas.mapping_file import LogMapping
from wmr_schemas.messages import METADATA_NAME
from wmr_schemas.robot import RobotParameters

_HASH_BYTES = 1 << 20
NO_MAPPING = LogMapping()


class LogReader:
    """A log whose channels in use are known. Made by :func:`open_log`.

    ``plan`` says which channel is the pose, the torque, the truth, and why the others are not; ``robot``
    holds the nominal parameters: the mapping's, else the log's own. ``losses``, ``census`` and ``remarks``
    are complete once :meth:`batches` is exhausted.
    """

    def __init__(self, path: Path, mapping: LogMapping) -> None:
        self.path = path
        self.survey = survey(path)
        sampler = Sampler(self.survey)
        sampler.run(path)
        book = self.survey.book
        self.candidates = [
            Candidate(
                channel,
                book.schemas.get(channel.schema_id),
                tuple(sampler.samples.get(channel.id, ())),
                sampler.n_messages(channel.id),
            )
            for _, channel in sorted(book.channels.items())
        ]
        self.plan: Plan = detect(path, self.candidates, mapping)
        self.remarks: list[str] = []
        self.robot = mapping.robot or self._own_parameters()
        self.clocks: dict[str, Clock] = {}
        self.losses = self._frame_losses()
        self.census = Census()
        self.position_bytes = 0

    @property
    def size_bytes(self) -> int:
        """Size of the file."""
        return self.survey.size_bytes

    @property
    def pose_is_odometry(self) -> bool:
        """Whether the pose may well have been integrated from wheel speeds, by its name."""
        return self.plan.pose_is_odometry

    @property
    def clock_notes(self) -> list[str]:
        """Which clock each channel goes by, and how far it is from the recorder's."""
        return [
            f"{self.plan.uses[role].channel.topic}: {clock.describe()}" for role, clock in self.clocks.items()
        ]

    def batches(self) -> Iterator[RawBatch]:
        """Rows of the channels in use in file order, a batch for each chunk or stretch of plain records."""
        self.losses = self._frame_losses()
        self.clocks = {role: Clock.choose(use) for role, use in self.plan.uses.items()}
        reading = Reading(self.plan.uses, self.clocks, self.survey.book, self.losses)
        self.census = reading.census
        for block in load_ahead(self.path, self.survey.spans):
            batch = reading.push(block)
            self.position_bytes = block.span.data_offset + block.span.data_bytes
            yield batch
        statistics = self.survey.statistics
        reading.finish(None if statistics is None else sum(statistics.values()))
        self.remarks += reading.remarks
        self.position_bytes = self.size_bytes

    def _frame_losses(self) -> Losses:
        """What the survey of the file's frame already found."""
        found = self.survey
        return Losses(
            n_chunks_damaged=found.n_chunks_damaged, truncated=found.truncated, notes=list(found.notes)
        )

    def _own_parameters(self) -> RobotParameters:
        """The log's metadata record; a broken one is remarked on and left aside."""
        try:
            return RobotParameters.from_metadata(self.survey.metadata.get(METADATA_NAME, {}))
        except InvalidFile as error:
            self.remarks.append(f"{error}; the record is left aside")
            return RobotParameters()


def open_log(path: Path, mapping: LogMapping = NO_MAPPING, *, need_pose: bool = True) -> LogReader:
    """Open an MCAP log and find its signals.

    Raises LogUnusable when it is no MCAP file, ChannelNotFound when it has no pose (unless ``need_pose`` is
    false) or when a topic that ``mapping`` names does not serve.
    """
    check_entrance(path)
    try:
        reader = LogReader(path, mapping)
    except OSError as error:
        raise unreadable(path, error) from None
    if need_pose and reader.plan.pose is None:
        raise not_found(path, "pose", reader.candidates, reader.plan)
    return reader


def sha256_of(path: Path) -> str:
    """Hash of a file, in hexadecimal."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while piece := file.read(_HASH_BYTES):
            digest.update(piece)
    return digest.hexdigest()
