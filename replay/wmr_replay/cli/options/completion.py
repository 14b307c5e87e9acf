"""What a shell offers behind Tab for scenarios, suites, effects, metrics, settings, modes and verdicts."""

from collections.abc import Callable, Iterable

import click
from click.shell_completion import CompletionItem

from wmr_replay.cli.options.names import METRICS, SCENARIOS, SETTINGS, SUITES

Completer = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]
COMPARISONS = (">=", "<=")


def one_of(names: Iterable[str], ending: str = "") -> Completer:
    """A completer of names; ``ending`` follows each."""
    known = [name + ending for name in names]
    return lambda _ctx, _param, given: [CompletionItem(name) for name in known if name.startswith(given)]


def files_or(names: Iterable[str]) -> Completer:
    """A completer of names, and of files where none begins like what is there."""
    named = one_of(names)
    return lambda ctx, param, given: named(ctx, param, given) or [CompletionItem(given, type="file")]


def list_of(names: Iterable[str]) -> Completer:
    """A completer of names between commas."""
    known = tuple(names)

    def complete(_ctx: click.Context, _param: click.Parameter, given: str) -> list[CompletionItem]:
        head, comma, last = given.rpartition(",")
        taken = head.split(",")
        rest = [name for name in known if name.startswith(last) and name not in taken]
        return [CompletionItem(head + comma + name) for name in rest]

    return complete


def complete_effect(_ctx: click.Context, _param: click.Parameter, given: str) -> list[CompletionItem]:
    """``NAME``, then ``NAME:PARAM=``, further parameters behind commas; users' own effects too."""
    from wmr_schemas.effects import BEYOND, catalogue

    effects = {**catalogue(), **BEYOND}
    name, colon, inside = given.partition(":")
    if not colon:
        return [CompletionItem(effect) for effect in effects if effect.startswith(given)]
    head, comma, last = inside.rpartition(",")
    known = effects[name].parameters if name in effects else ()
    rest = [key for key in known if key.startswith(last)]
    return [CompletionItem(f"{name}:{head}{comma}{key}=") for key in rest]


def complete_metric(_ctx: click.Context, _param: click.Parameter, given: str) -> list[CompletionItem]:
    """A column of the summary, then a comparison."""
    if given in METRICS:
        return [CompletionItem(f"{given}{sign}") for sign in COMPARISONS]
    return [CompletionItem(name) for name in METRICS if name.startswith(given)]


def complete_effects(ctx: click.Context, param: click.Parameter, given: str) -> list[CompletionItem]:
    """Names of effects that torques show, between commas."""
    from wmr_schemas.effects import named_of

    return list_of(named_of("torque"))(ctx, param, given)


complete_scenario = files_or(SCENARIOS)
complete_suite = files_or(SUITES)
complete_setting = one_of(SETTINGS, "=")
complete_modes = one_of(("identified", "ideal", "topic:"))
