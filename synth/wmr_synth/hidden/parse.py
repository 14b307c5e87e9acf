"""``NAME[:param=value,…]``, as ``--hide`` has it."""

import difflib
import math

from wmr_schemas.effects import BEYOND, catalogue
from wmr_schemas.errors import InvalidSetting


def parse_hide(text: str) -> tuple[str, dict[str, float]]:
    """The effect's name and the parameters given. Raises InvalidSetting with the known names."""
    name, _, rest = text.partition(":")
    known = {**catalogue(), **BEYOND}
    if name not in known:
        near = difflib.get_close_matches(name, known, n=2)
        hint = f"did you mean {' or '.join(near)}? " if near else ""
        raise InvalidSetting(f"no effect {name!r}; {hint}known are {', '.join(known)}")
    given: dict[str, float] = {}
    for part in filter(None, rest.split(",")):
        key, _, value = part.partition("=")
        if key not in known[name].parameters:
            raise InvalidSetting(f"{name} has no {key!r}; it has {', '.join(known[name].parameters)}")
        given[key] = parse_value(name, key, value)
    return name, given


def parse_value(name: str, key: str, text: str) -> float:
    """A finite number."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InvalidSetting(f"{name}: {key} must be a number, not {text!r}")
    return value
