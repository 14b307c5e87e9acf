"""Errors that carry facts; only the command line turns them into text and exit codes.

The facts are as they are in the file; the texts (``str(error)``) hold no control code, see
:mod:`wmr_schemas.text`.
"""

from collections.abc import Sequence
from pathlib import Path

from wmr_schemas.text import shown, shown_lines


class WmrError(Exception):
    """Root of everything that this toolkit raises on purpose."""


class InvalidSignal(WmrError):
    """A signal breaks its own rules: ``signal``, ``problem`` and, where one row is at fault, ``row``."""

    def __init__(self, signal: str, problem: str, row: int | None = None) -> None:
        self.signal, self.problem, self.row = signal, problem, row
        super().__init__(shown(f"{signal}: {problem}" + ("" if row is None else f" at row {row}")))


class InvalidFile(WmrError):
    """A model, robot or scenario file that cannot be used; ``key`` names the place inside it."""

    def __init__(self, path: Path | str, key: str, problem: str) -> None:
        self.path, self.key, self.problem = str(path), key, problem
        super().__init__(shown(f"{path}: {key}: {problem}" if key else f"{path}: {problem}"))


class InvalidTerm(WmrError):
    """A dictionary term outside the grammar of :mod:`wmr_schemas.terms`; ``name`` is the effect's."""

    def __init__(self, name: str, problem: str) -> None:
        self.name, self.problem = name, problem
        super().__init__(f"{name}: {problem}")


class LogUnusable(WmrError):
    """A log that cannot be analysed: the problem, its place, and a remedy to try."""

    def __init__(self, path: object, problem: str, advice: str = "") -> None:
        self.path, self.problem, self.advice = str(path), problem, advice
        super().__init__(
            f"{shown(path)}: {shown_lines(problem)}" + (f"\n{shown_lines(advice)}" if advice else "")
        )


class ChannelNotFound(LogUnusable):
    """No channel serves as ``wanted``; ``available`` lists (topic, schema name, why it does not serve)."""

    def __init__(
        self, wanted: str, path: object, available: Sequence[tuple[str, str, str]], advice: str = ""
    ) -> None:
        self.wanted, self.available = wanted, tuple(available)
        rows = "\n".join(shown(f"  {topic} ({schema}): {why}") for topic, schema, why in self.available)
        held = f"the file holds:\n{rows}" if rows else "the file holds no channel at all"
        super().__init__(path, f"no {shown(wanted)} found; {held}", advice)


class DamagedLog(LogUnusable):
    """Raised under ``--strict`` when something in the file was lost."""


class InvalidSetting(WmrError):
    """A setting that makes no sense, such as a window of no length."""


class InvalidEffect(InvalidSetting):
    """A user's effect that cannot be used; ``source`` is its entry point or its name."""

    def __init__(self, source: str, problem: str) -> None:
        self.source, self.problem = source, problem
        super().__init__(f"effect {source}: {problem}")


class MissingExtra(InvalidSetting):
    """Something needs a package that only an extra brings: ``extra``, what ``needs`` it, the ``package``."""

    def __init__(self, extra: str, needs: str, package: str | None = None) -> None:
        self.extra, self.needs, self.package = extra, needs, package
        missing = f" (there is no package {package})" if package else ""
        super().__init__(f"{needs} needs an extra{missing}: pip install 'wmr-replay[{extra}]'")
