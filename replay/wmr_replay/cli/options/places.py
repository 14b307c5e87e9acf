"""Arguments that are a path or a URL."""

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

if TYPE_CHECKING:
    from wmr_replay.api.places import LogPath


class LogPlace(click.ParamType["LogPath"]):
    """A file or directory on this machine, or a URL."""

    name = "path or URL"

    def convert(
        self, value: "str | LogPath", param: click.Parameter | None, ctx: click.Context | None
    ) -> "LogPath":
        """The text as a path or URL."""
        from wmr_replay.api.places import place_of

        return place_of(value)

    def shell_complete(
        self, ctx: click.Context, param: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        """Files and directories."""
        return [CompletionItem(incomplete, type="file")]


class LocalFolder(click.Path):
    """A directory of this machine; a URL is refused."""

    def convert(
        self, value: "str | os.PathLike[str]", param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        """The text as a path; a URL is a usage error."""
        if "://" in str(value):
            self.fail(f"{value} is a URL; `wmr-replay batch` writes to URLs, this a directory", param, ctx)
        return super().convert(value, param, ctx)


class ModelFile(click.Path):
    """A model file; a directory, such as ``fit --out`` fills, is refused with the models in it."""

    def convert(
        self, value: "str | os.PathLike[str]", param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        """The text as a path; a directory is a usage error."""
        if Path(value).is_dir():
            models = sorted(map(str, Path(value).glob("*.model.toml")))
            self.fail(f"{value} is a directory; give {' or '.join(models) or 'a model file'}", param, ctx)
        return super().convert(value, param, ctx)


LOG = LogPlace()
MODEL_FILE = ModelFile(exists=True, dir_okay=False, path_type=Path)
FOLDER = LocalFolder(file_okay=False, path_type=Path)
