"""The files that hold options: which there are, and what stands in them."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wmr_schemas.errors import InvalidFile
from wmr_schemas.tomlfile import expect_table, read_toml

OWN_FILE, SHARED_FILE, TABLE = "wmr-replay.toml", "pyproject.toml", "wmr-replay"


@dataclass(frozen=True)
class ConfigFile:
    """Options by key, as they stand in the file; tables named after commands hold those of one command."""

    path: Path
    content: Mapping[str, Any]
    is_project: bool = False
    is_result: bool = False


def read_config(path: Path) -> ConfigFile:
    """A TOML file, or the file of a result: its JSON, or the model of a fit. Raises InvalidFile."""
    if path.suffix == ".json":
        from wmr_replay.cli.config.stored import stored_options

        return ConfigFile(path, stored_options(path, read_json(path)), is_result=True)
    content = read_toml(path)
    if "provenance" in content:
        from wmr_replay.cli.config.stored import model_options

        return ConfigFile(path, model_options(path, content), is_result=True)
    return ConfigFile(path, tool_table(path, content) if path.name == SHARED_FILE else content)


def project_file(folder: Path) -> ConfigFile | None:
    """The nearest ``wmr-replay.toml``, or ``pyproject.toml`` with a table ``[tool.wmr-replay]``, upwards."""
    for place in (folder, *folder.parents):
        for path in (place / OWN_FILE, place / SHARED_FILE):
            content = project_content(path)
            if content is not None:
                return ConfigFile(path, content, is_project=True)
    return None


def project_content(path: Path) -> Mapping[str, Any] | None:
    """The options of a project's file; None where there are none."""
    try:
        text = path.read_bytes()
    except OSError:
        return None
    if path.name == OWN_FILE:
        return read_toml(path)
    return tool_table(path, read_toml(path)) or None if TABLE.encode() in text else None


def tool_table(path: Path, content: Mapping[str, Any]) -> Mapping[str, Any]:
    """The table ``[tool.wmr-replay]``; empty without one."""
    tools = content.get("tool", {})
    return expect_table(path, f"tool.{TABLE}", tools.get(TABLE, {}) if isinstance(tools, dict) else {})


def read_json(path: Path) -> dict[str, Any]:
    """The object in a JSON file. Raises InvalidFile."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise InvalidFile(path, "", f"is no JSON file: {error}") from None
    if not isinstance(content, dict):
        raise InvalidFile(path, "", "is not the JSON file of a result")
    return content


def entries(config: ConfigFile, command: str, commands: Mapping[str, str]) -> Iterator[tuple[str, str, Any]]:
    """What a file says for a command: (key as an error names it, key, value), those of its own table last.

    ``commands``: names and former names of commands by name.
    """
    tables = [name for name in config.content if name in commands]
    for key, value in config.content.items():
        if key not in tables:
            yield key, key, value
    for name in tables:
        table = expect_table(config.path, name, config.content[name])
        if commands[name] == command:
            yield from ((f"{name}.{key}", key, value) for key, value in table.items())
