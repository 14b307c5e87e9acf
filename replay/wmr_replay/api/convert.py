"""A CSV file of poses, and perhaps torques and wheel speeds, or a ROS bag, as an MCAP log."""

from collections.abc import Callable
from pathlib import Path

from wmr_replay.api.places import LocalPlace, Place, home_of, local_path, place_of
from wmr_replay.ingest import open_log
from wmr_replay.jobs.bag_copy import Copied, copy_as_mcap
from wmr_replay.jobs.convert import read_csv
from wmr_schemas.csv_map import CsvMap, read_csv_map
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.files import whole_file
from wmr_schemas.signals import Log
from wmr_synth import write_mcap


class Converted:
    """The answer of ``convert``.

    Attributes:
        log: The signals, as ``replay`` takes them.
        n_rows: Rows of the file that were used.
        n_left_out: Rows left out because of their time or of missing numbers.
    """

    def __init__(self, log: Log, n_rows: int, n_left_out: int) -> None:
        self.log, self.n_rows, self.n_left_out = log, n_rows, n_left_out

    def save(self, path: LocalPlace, *, encoding: str = "ros2") -> Path:
        """Write the log as MCAP, whole or not at all; the file."""
        target = local_path(path)
        home_of(target)
        with whole_file(target) as part:
            write_mcap(self.log, part, encoding=encoding)
        return target

    def __repr__(self) -> str:
        return f"<Converted log: {self.n_rows} rows, {self.n_left_out} left out>"


def convert(
    csv: LocalPlace, columns: CsvMap | LocalPlace, out: LocalPlace | None = None, *, encoding: str = "ros2"
) -> Converted:
    """Read a CSV file with a row per pose sample.

    Args:
        csv: The file; its first line names the columns.
        columns: Which columns hold what, and where the pose is of: a map or its file (``columns.toml``).
        out: MCAP file to write; None: nothing is written.
        encoding: Message encoding of ``out``: ``ros2``, ``protobuf`` or ``json``.

    Raises:
        LogUnusable: The file cannot be read, or has no row to use.
        InvalidFile: A column that the file lacks, or a mistake in the map.
    """
    if out is not None:
        home_of(local_path(out))
    csv_map = columns if isinstance(columns, CsvMap) else read_csv_map(local_path(columns))
    found = read_csv(local_path(csv), csv_map)
    converted = Converted(found.log, found.n_rows, found.n_left_out)
    if out is not None:
        converted.save(out, encoding=encoding)
    return converted


def convert_bag(log: Place, out: LocalPlace, *, progress: Callable[[int, int], None] | None = None) -> Copied:
    """Write the messages of a ROS bag to an MCAP file, for other tools: this one reads bags as they are.

    Args:
        log: A ROS bag (``.db3``, ``.bag``), a rosbag2 directory, or any other log.
        out: MCAP file to write, whole or not at all. Bytes, definitions and times stay as they are.
        progress: Called with bytes read and bytes in all.

    Returns:
        How many messages were written, and notes on what was lost.

    Raises:
        LogUnusable: It is no log.
        InvalidSetting: ``out`` is the log itself.
    """
    target, source = local_path(out), place_of(log)
    home_of(target)
    if isinstance(source, Path) and target.resolve() == source.resolve():
        raise InvalidSetting(f"{target} is the log itself; name another file")
    return copy_as_mcap(open_log(source, need_pose=False), target, progress)
