"""Options from files as defaults of a call. Above them stands the command line, below them the defaults.

Where several files name an option, ``--config`` stands above the project's file.
"""

import difflib
import importlib
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import click

from wmr_replay.cli.commands import ALIASES, COMMANDS
from wmr_replay.cli.config.files import ConfigFile, entries, project_file, read_config
from wmr_replay.cli.config.stored import DECIDING, FileText
from wmr_replay.cli.options.places import LogPlace
from wmr_schemas.errors import InvalidFile
from wmr_schemas.text import shown
from wmr_schemas.tomlfile import expect_number

NO_KEYS = {"config", "quiet", "verbose", "help", "list", "list-effects", "version"}
FILES, SETTINGS, FROM_PROJECT = "wmr_replay.files", "wmr_replay.settings", "wmr_replay.from_project"
"""What a call's context holds besides: the files read, settings without an option, options of the project."""


def apply_files(ctx: click.Context, path: Path | None) -> None:
    """Read the project's file and ``--config``, and make what they say the defaults of this call.

    Raises InvalidFile for a key that no command has, and for a value that its option refuses.
    """
    files = [found for found in (project_file(Path.cwd()), path and read_config(path)) if found]
    defaults: dict[str, Any] = {}
    settings: dict[str, Any] = {}
    from_project: set[str] = set()
    for config in files:
        options, others = options_of(ctx, config)
        if config.is_result:
            defaults, settings = undecided(defaults), {}
        defaults |= options
        settings |= others
        from_project = (
            from_project | {*options, *others} if config.is_project else from_project - {*options, *others}
        )
    ctx.default_map = {**(ctx.default_map or {}), **defaults}
    from_project &= {*defaults, *settings}
    ctx.meta.update({FILES: files, SETTINGS: settings, FROM_PROJECT: from_project})


def undecided(defaults: Mapping[str, Any]) -> dict[str, Any]:
    """The project's options without those that decide an answer: a result states all of these."""
    from wmr_replay.api.request import SettingsArguments

    deciding = DECIDING | set(SettingsArguments.__annotations__)
    return {name: value for name, value in defaults.items() if name not in deciding}


def options_of(ctx: click.Context, config: ConfigFile) -> tuple[dict[str, Any], dict[str, Any]]:
    """What a file says for this command: values by parameter, and settings that have no option."""
    command = ctx.command.name or ""
    names = {**{name: name for name in COMMANDS}, **ALIASES}
    known, other_settings = keys_of(ctx.command), settings_of(ctx.command)
    options: dict[str, Any] = {}
    others: dict[str, Any] = {}
    for place, key, value in entries(config, command, names):
        if key in known:
            option = known[key]
            options[option.name or key] = checked(ctx, config, place, option, value)
        elif key in other_settings:
            others[key] = expect_number(config.path, place, value)
        elif place != key or key not in keys_of_all():
            raise unknown(config, place, key, known if place != key else keys_of_all())
    return options, others


def keys_of(command: click.Command) -> dict[str, click.Option]:
    """Options by key: as on the command line without the dashes, and by the name of the setting."""
    found: dict[str, click.Option] = {}
    for param in command.params:
        if isinstance(param, click.Option):
            keys = {name.removeprefix("--") for name in param.opts if name.startswith("--")}
            keys |= {key.replace("-", "_") for key in keys} | {param.name or ""}
            found |= dict.fromkeys(keys - NO_KEYS, param)
    return found


def settings_of(command: click.Command) -> set[str]:
    """Settings without an option, for a command that replays logs."""
    if not any(param.name == "threshold_sd" for param in command.params):
        return set()
    from wmr_replay.api.request import SettingsArguments

    return set(SettingsArguments.__annotations__) - set(keys_of(command))


def keys_of_all() -> set[str]:
    """Keys of any command: a line for all commands may concern some of them alone."""
    found: set[str] = set()
    for name in COMMANDS:
        command = importlib.import_module(f"wmr_replay.cli.{name}").command
        found |= set(keys_of(command)) | settings_of(command)
    return found


def checked(ctx: click.Context, config: ConfigFile, place: str, option: click.Option, value: Any) -> Any:
    """The value as the option takes it; a path that is not absolute is one beside the file.

    Raises InvalidFile naming the key.
    """
    if option.is_flag != isinstance(value, bool):
        raise InvalidFile(
            config.path, place, "must be true or false" if option.is_flag else "must be a value"
        )
    if isinstance(value, dict) or (isinstance(value, list) and not option.multiple):
        raise InvalidFile(config.path, place, "must be one value")
    given = [beside(ctx, config, option, one) for one in (value if isinstance(value, list) else [value])]
    try:
        option.type_cast_value(ctx, given if option.multiple else given[0])
    except click.UsageError as error:
        raise InvalidFile(config.path, place, error.message.rstrip(".")) from None
    return given if option.multiple else given[0]


def beside(ctx: click.Context, config: ConfigFile, option: click.Option, value: Any) -> Any:
    """A path beside the file; the text of a file as a temporary one; anything else as it is."""
    if isinstance(value, FileText):
        folder = ctx.with_resource(tempfile.TemporaryDirectory(prefix="wmr-replay-"))
        path = Path(folder, f"{option.name}.toml")
        path.write_text(value, encoding="utf-8")
        return str(path)
    is_path = isinstance(option.type, click.Path | LogPlace) and isinstance(value, str) and "://" not in value
    return str(config.path.absolute().parent / value) if is_path else value


def unknown(config: ConfigFile, place: str, key: str, known: Mapping[str, Any] | set[str]) -> InvalidFile:
    """The error for a key that there is not, with the nearest ones."""
    near = difflib.get_close_matches(key.replace("_", "-"), sorted(known), n=2)
    meant = f"; did you mean {' or '.join(near)}?" if near else ""
    return InvalidFile(config.path, place, f"there is no such option{meant}")


def files_said(ctx: click.Context) -> Iterator[str]:
    """A line for each file that was read, for --verbose."""
    for config in ctx.meta.get(FILES, ()):
        yield shown(f"options from {config.path}")
