"""A calibrated model as another tool's parameters."""

from wmr_replay.api.places import LocalPlace, home_of, local_path
from wmr_replay.api.request import ModelLike, model_of
from wmr_replay.jobs.export import FORMATS, ros2_diff_drive
from wmr_replay.jobs.mjcf_file import Joints
from wmr_replay.jobs.mjcf_parameters import mjcf_parameters
from wmr_replay.jobs.mjcf_patch import fragment, patched
from wmr_schemas.errors import InvalidSetting
from wmr_schemas.files import whole_file
from wmr_schemas.model_file import Model


def export(
    model: ModelLike,
    out: LocalPlace | None = None,
    *,
    to: str = "ros2-diff-drive",
    into: LocalPlace | None = None,
    joints: Joints | None = None,
) -> str:
    """A model as another tool's parameters; the text.

    Args:
        model: Model or model file, as ``fit`` and ``gap`` write it.
        out: File to write; None: nothing is written.
        to: ``ros2-diff-drive``: wheel scales and effective track as YAML for ROS 2's
            ``diff_drive_controller``. ``mjcf``: what the model says beyond the simulator that it was held
            against, in MuJoCo's format.
        into: Of ``mjcf``: the robot's own file, whose text is returned with the parameters in it; None: a
            fragment to copy from.
        joints: Of ``into``: names of the wheels' joints, (left, right); None: by left and right in names.

    Raises:
        InvalidFile: The model file or the MJCF cannot be read.
        InvalidSetting: An unknown format, a model that lacks what the format needs, an MJCF without wheels.
    """
    if to not in FORMATS:
        raise InvalidSetting(f"to is one of {', '.join(FORMATS)}, not {to!r}")
    read = model_of(model)
    if read is None:
        raise InvalidSetting("no model was named")
    if to != "mjcf" and (into is not None or joints is not None):
        raise InvalidSetting(f"into and joints belong to mjcf, not to {to}")
    text = mjcf(read, into, joints) if to == "mjcf" else ros2_diff_drive(read)
    if out is not None:
        target = local_path(out)
        home_of(target)
        with whole_file(target) as part:
            part.write_text(text, encoding="utf-8")
    return text


def mjcf(model: Model, into: LocalPlace | None, joints: Joints | None) -> str:
    """The model in MuJoCo's format."""
    wanted = mjcf_parameters(model)
    return fragment(wanted) if into is None else patched(local_path(into), wanted, joints)
