"""Options that show a timeline: in the viewer, in a browser, as a picture."""

import atexit
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from wmr_replay.timeline.viewer import Server

F = TypeVar("F", bound=Callable[..., Any])

OPTIONS = (
    click.option("--view", is_flag=True, help="Show the timeline in the Rerun viewer."),
    click.option("--serve", is_flag=True, help="Show the timeline in a browser, until Ctrl-C."),
    click.option(
        "--bind",
        metavar="ADDRESS",
        default="127.0.0.1",
        help="Where --serve listens: this machine alone by default; 0.0.0.0 is open to the network.",
    ),
    click.option(
        "--screenshot",
        type=click.Path(path_type=Path, dir_okay=False),
        metavar="FILE.png",
        help="Write a picture of the timeline; needs no screen.",
    ),
)


def viewing_options(command: F) -> F:
    """Add --view, --serve, --bind and --screenshot."""
    for option in reversed(OPTIONS):
        command = option(command)
    return command


@dataclass
class Viewing:
    """What the options ask for, and the server once it runs. What cannot be shown is a warning: the results
    are complete without it.
    """

    view: bool
    serve: bool
    bind: str
    screenshot: Path | None
    _server: "Server | None" = None
    _streamed: bool = False

    @classmethod
    def of(cls, options: Mapping[str, Any], *, no_rrd: bool) -> "Viewing":
        """The options; a usage error where there is no timeline to show."""
        asked = cls(options["view"], options["serve"], options["bind"], options["screenshot"])
        for name in ("view", "serve", "screenshot"):
            if no_rrd and getattr(asked, name):
                raise click.UsageError(f"--{name} needs the timeline that --no-rrd leaves out")
        return asked

    @property
    def live(self) -> "Callable[[], str | None] | None":
        """What opens a viewer for rows as they come, and gives its address; None where none is asked for."""
        return self._open if self.view or self.serve else None

    def _open(self) -> str | None:
        """Address of the server, else of the viewer."""
        if self.serve:
            return self._start_server()
        from wmr_replay.api.viewer import view

        address = _or_warning(view)
        self._streamed = address is not None
        return address

    def _start_server(self, *recordings: Path) -> str | None:
        from wmr_replay.api.viewer import serve
        from wmr_replay.cli.printing.plain import tell

        self._server = _or_warning(lambda: serve(*recordings, bind=self.bind))
        if self._server is None:
            return None
        atexit.register(self._server.stop)
        tell(f"viewer at {self._server.page}")
        return self._server.address

    def show(self, *recordings: Path) -> None:
        """Show the finished recordings, where they are not shown already; serve until Ctrl-C."""
        from wmr_replay.api.viewer import screenshot, view

        if self.screenshot is not None:
            if len(recordings) != 1:
                raise click.UsageError(f"--screenshot is for one timeline; there are {len(recordings)}")
            picture = self.screenshot
            _or_warning(lambda: screenshot(recordings[0], picture))
        if self.view and not self._streamed and recordings:
            _or_warning(lambda: view(*recordings))
        if self.serve and self._server is None:
            self._start_server(*recordings)
        if self._server is not None:
            self._server.wait()


T = TypeVar("T")


def _or_warning(act: Callable[[], T]) -> T | None:
    """What ``act`` gives; a warning and None where there is no viewer."""
    from wmr_replay.cli.printing.plain import tell
    from wmr_replay.timeline.viewer import ViewerUnavailable

    try:
        return act()
    except ViewerUnavailable as error:
        tell(f"warning: {error}")
        return None
