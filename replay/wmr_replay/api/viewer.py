"""Looking at timelines: in the viewer, in a browser, as a picture."""

from pathlib import Path

from wmr_replay.api.places import LocalPlace, home_of, local_path
from wmr_replay.timeline.picture import HEIGHT, WIDTH, take_picture
from wmr_replay.timeline.viewer import LOOPBACK, Server, open_viewer, start_server
from wmr_schemas.errors import InvalidSetting


def view(*recordings: LocalPlace) -> str:
    """Open recordings (``.rrd``) in the Rerun viewer and return at once.

    Without recordings an empty viewer opens. The address that is returned is one for ``run(…, live=…)``.

    Raises:
        ViewerUnavailable: There is no screen here, or the viewer does not start.
    """
    return open_viewer(*map(recording_at, recordings))


def serve(*recordings: LocalPlace, bind: str = LOOPBACK) -> Server:
    """Serve recordings to browsers, to this machine alone unless ``bind`` says otherwise.

    Without recordings the server shows what ``run(…, live=server.address)`` sends. ``server.page`` is the
    page's address; ``server.stop()`` ends it.

    Raises:
        ViewerUnavailable: The server does not start.
    """
    return start_server([recording_at(place) for place in recordings], bind)


def screenshot(
    recording: LocalPlace, picture: LocalPlace, *, width: int = WIDTH, height: int = HEIGHT, at_s: float = 0.0
) -> Path:
    """Write a picture (PNG) of a recording as the viewer shows it, once its axes have come to rest.

    No screen is needed, but a Vulkan driver is; a software one will do.

    Args:
        recording: A recording (``.rrd``).
        picture: Where the picture goes.
        width: Width in pixels.
        height: Height in pixels.
        at_s: Where the cursor is, in s from the log's start.

    Raises:
        ViewerUnavailable: There is no Vulkan driver, or the viewer does not start.
    """
    target = local_path(picture)
    home_of(target)
    take_picture(recording_at(recording), target, width, height, at_s)
    return target


def recording_at(place: LocalPlace) -> Path:
    """A recording's path. Raises InvalidSetting where there is none."""
    path = local_path(place)
    if not path.is_file():
        raise InvalidSetting(f"no recording at {path}")
    return path
