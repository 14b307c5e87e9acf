"""A calibrated model as another tool's parameters."""

from wmr_replay.api.places import LocalPlace, home_of, local_path
from wmr_replay.api.request import ModelLike, model_of
from wmr_replay.jobs.export import FORMATS, ros2_diff_drive
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.files import whole_file


def export(model: ModelLike, out: LocalPlace | None = None, *, to: str = "ros2-diff-drive") -> str:
    """A model's wheel scales and effective track as another tool's parameters; the text.

    Args:
        model: Model or model file, as ``fit`` writes it for wheel speeds.
        out: File to write; None: nothing is written.
        to: ``ros2-diff-drive``: YAML for ROS 2's ``diff_drive_controller``.

    Raises:
        InvalidFile: The model file cannot be read.
        InvalidSetting: An unknown format, or a model without wheel scales and track.
    """
    if to not in FORMATS:
        raise InvalidSetting(f"to is one of {', '.join(FORMATS)}, not {to!r}")
    read = model_of(model)
    if read is None:
        raise InvalidSetting("no model was named")
    text = ros2_diff_drive(read)
    if out is not None:
        target = local_path(out)
        home_of(target)
        with whole_file(target) as part:
            part.write_text(text, encoding="utf-8")
    return text
