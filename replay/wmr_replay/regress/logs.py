"""Logs named by a caller: files, bags, and directories of them."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from wmr_schemas.errors import InvalidSetting

PATTERNS = ("*.mcap", "*.mcap.zst", "*.db3", "*.bag")


def find_logs(paths: Sequence[Path]) -> list[Path]:
    """The logs, those of a directory by name; a directory with a metadata.yaml is a bag, one log itself.

    Raises InvalidSetting for a directory without logs, and for two logs of one stem: results go by it.
    """
    logs = [log for path in paths for log in logs_of(path)]
    twice = [stem for stem, n in Counter(log.stem for log in logs).items() if n > 1]
    if twice:
        raise InvalidSetting(f"two logs are called {twice[0]}; their results could not be told apart")
    return logs


def logs_of(path: Path) -> list[Path]:
    """One log, or those of a directory."""
    if not path.is_dir() or (path / "metadata.yaml").exists():
        return [path]
    found = sorted(log for pattern in PATTERNS for log in path.glob(pattern))
    if not found:
        raise InvalidSetting(f"{path}: this directory holds no log ({', '.join(PATTERNS)})")
    return found
