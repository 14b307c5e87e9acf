"""The two ways to a terminal, lines of text and rich's tables: neither lets a control code through.

Names and texts of a file are never read as markup: a topic may be called ``[/bold]`` or ``:bomb:``. Styles
are given beside the text, as in :func:`styled`.
"""

import sys
from typing import Any

from rich.console import Console, ConsoleOptions, ConsoleRenderable, RenderHook, RenderResult
from rich.segment import Segment
from rich.text import Text

from wmr_replay.cli import activity
from wmr_replay.cli.verbosity import heard
from wmr_schemas.text import shown, shown_lines


def say(text: object, *, err: bool = False, end: str = "\n") -> None:
    """Print text in its own lines, control codes escaped."""
    activity.stop()
    print(shown_lines(text), end=end, file=sys.stderr if err else sys.stdout, flush=True)


def tell(text: object) -> None:
    """The same on standard error under --quiet too: what was asked for, such as the address of a server."""
    activity.stop()
    print(shown_lines(text), file=heard(), flush=True)


def console_of(**options: Any) -> Console:
    """A console that takes text as it is, and escapes control codes."""
    activity.stop()
    console = _Console(highlight=False, markup=False, emoji=False, **options)
    console.push_render_hook(_Escaping())
    return console


def styled(*parts: str | tuple[str, str]) -> Text:
    """A line of parts, each a text or (text, style), with line ends escaped too."""
    return Text.assemble(*(shown(p) if isinstance(p, str) else (shown(p[0]), p[1]) for p in parts))


class _Console(Console):
    """A console that leaves a reader that has gone to the caller."""

    def on_broken_pipe(self) -> None:
        """Raises BrokenPipeError."""
        raise BrokenPipeError


class _Escaping(RenderHook):
    """A hook of a console that escapes control codes in the text of everything that it prints."""

    def process_renderables(self, renderables: list[ConsoleRenderable]) -> list[ConsoleRenderable]:
        """The same, each behind the escape."""
        return [_Escaped(renderable) for renderable in renderables]


class _Escaped:
    """One thing to print, its text escaped after it is laid out; rich's own codes are added later."""

    def __init__(self, inside: ConsoleRenderable) -> None:
        self.inside = inside

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        for segment in console.render(self.inside, options):
            is_text = segment.control is None
            yield Segment(shown_lines(segment.text), segment.style) if is_text else segment
