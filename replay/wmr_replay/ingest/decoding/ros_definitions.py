"""Definitions out of the file's own schemas (``ros2msg``, ``ros2idl``, ``ros1msg``), as one tree of types.

rosbags parses the text. Names come as ``pkg/Type`` or ``pkg/msg/Type`` and are kept as ``pkg/msg/Type``.
"""

import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

PRIMITIVES = {
    "bool": "u1",
    "byte": "u1",
    "char": "u1",
    "octet": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float32": "f4",
    "float64": "f8",
}
"""Numbers of the definition languages as numpy types, without byte order."""

_TIMES = {
    "builtin_interfaces/msg/Time": (("sec", "int32"), ("nanosec", "uint32")),
    "builtin_interfaces/msg/Duration": (("sec", "int32"), ("nanosec", "uint32")),
}
"""ROS 1's ``time`` and ``duration``, which no schema describes."""
_SEPARATOR = re.compile(r"^=+$", re.MULTILINE)
_IDL_HEADING = re.compile(r"^=+\s*\nIDL:.*$|^IDL:.*$", re.MULTILINE)


class UnknownDefinition(ValueError):
    """A schema that cannot be turned into types, and why."""


@dataclass(frozen=True)
class Node:
    """A number, ``string`` or ``wstring`` (``name``), or a message (``fields``); ``count`` repeats it.

    ``count``: None for one, −1 for a sequence, otherwise a fixed array.
    """

    name: str
    fields: tuple[tuple[str, "Node"], ...] | None = None
    count: int | None = None

    def has(self, path: str) -> bool:
        """Whether a dotted path leads somewhere, repeated types included at its end only."""
        node = self
        for step in path.split("."):
            if node.count is not None or node.fields is None:
                return False
            found = dict(node.fields).get(step)
            if found is None:
                return False
            node = found
        return True


@lru_cache(maxsize=256)
def parse_definition(name: str, encoding: str, text: str) -> Node:
    """The type ``name`` of a schema text. Raises UnknownDefinition."""
    from rosbags.typesys import TypesysError, get_types_from_idl, get_types_from_msg  # noqa: PLC0415

    if not encoding:
        raise UnknownDefinition(f"the log holds no definition of {name}, and it is none of ROS's own types")
    if encoding not in {"ros2msg", "ros1msg", "ros2idl"}:
        raise UnknownDefinition(f"schema encoding {encoding!r} is not read")
    full = full_name(name)
    plain = text.replace("\r\n", "\n")
    try:
        if encoding == "ros2idl":
            types = get_types_from_idl(_IDL_HEADING.sub("", plain))
        else:
            types = get_types_from_msg(_SEPARATOR.sub("=" * 80, plain), full)
    except (TypesysError, ValueError, RecursionError):
        service = " (it describes a service or an action)" if "\n---" in plain else ""
        raise UnknownDefinition(f"its {encoding} definition cannot be parsed{service}") from None
    if full not in types:
        raise UnknownDefinition(f"its definition does not describe {full}")
    return _message(full, types, ())


def full_name(name: str) -> str:
    """``pkg/msg/Type`` for ``pkg/Type``; others as they are."""
    package, slash, short = name.partition("/")
    return name if "/" in short or not slash else f"{package}/msg/{short}"


def _message(name: str, types: Any, above: tuple[str, ...]) -> Node:
    """The tree of a message type. Raises UnknownDefinition."""
    if name in above:
        raise UnknownDefinition(f"{name} contains itself")
    if name.rpartition("/")[2] in {"wstring", "WString"} and name not in types:
        return Node("wstring")
    if name in _TIMES and name not in types:
        return Node(name, tuple((field, Node(kind)) for field, kind in _TIMES[name]))
    if name not in types:
        raise UnknownDefinition(f"type {name} is not described")
    _, entries = types[name]
    return Node(name, tuple((field, _node(entry, types, (*above, name))) for field, entry in entries))


def _node(entry: Any, types: Any, above: tuple[str, ...]) -> Node:
    """The tree of a field, from an entry of rosbags' parser. Raises UnknownDefinition."""
    kind, detail = entry[0].name, entry[1]
    if kind == "NAME":
        return _message(detail, types, above)
    if kind == "BASE":
        if detail[0] not in PRIMITIVES and detail[0] not in {"string", "wstring"}:
            raise UnknownDefinition(f"type {detail[0]} is not read")
        return Node(detail[0])
    inner, size = _node(detail[0], types, above), detail[1]
    if inner.count is not None:
        raise UnknownDefinition("arrays of arrays are not read")
    return Node(inner.name, inner.fields, size if kind == "ARRAY" else -1)
