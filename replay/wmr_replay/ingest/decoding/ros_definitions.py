"""Definitions out of the file's own schemas (``ros2msg``, ``ros2idl``, ``ros1msg``), as one tree of types.

rosbags parses the text. Names come as ``pkg/Type`` or ``pkg/msg/Type`` and are kept as ``pkg/msg/Type``.
"""

import re
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

from wmr_replay.ingest.budgets import BUDGETS

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
_COMMENT_LINE = re.compile(r"^[ \t]*#[^\n]*\n", re.MULTILINE)
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

    @cached_property
    def is_wide(self) -> bool:
        """Whether a wide string is in it."""
        return self.name == "wstring" or any(field.is_wide for _, field in self.fields or ())

    @cached_property
    def depth(self) -> int:
        """Levels of types, 0 of a number."""
        return 0 if self.fields is None else 1 + max((field.depth for _, field in self.fields), default=0)

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
    plain = without_comments(text)
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
    return _Tree(types).message(full)


def without_comments(text: str) -> str:
    """The definition without lines that hold a comment alone, which would take most of the parser's time."""
    return _COMMENT_LINE.sub("", text.replace("\r\n", "\n"))


def full_name(name: str) -> str:
    """``pkg/msg/Type`` for ``pkg/Type``; others as they are."""
    package, slash, short = name.partition("/")
    return name if "/" in short or not slash else f"{package}/msg/{short}"


class _Tree:
    """Builds the tree of a type; a type that occurs again is the same node: work grows with the text."""

    def __init__(self, types: Any) -> None:
        self.types, self.done = types, dict[str, Node]()
        self.above: list[str] = []

    def message(self, name: str) -> Node:
        """The tree of a message type. Raises UnknownDefinition."""
        if name in self.done:
            return self.done[name]
        if name in self.above:
            raise UnknownDefinition(f"{name} contains itself")
        if name.rpartition("/")[2] in {"wstring", "WString"} and name not in self.types:
            return Node("wstring")
        if name in _TIMES and name not in self.types:
            return Node(name, tuple((field, Node(kind)) for field, kind in _TIMES[name]))
        if name not in self.types:
            raise UnknownDefinition(f"type {name} is not described")
        if len(self.above) > BUDGETS.most_depth:
            raise _too_deep()
        self.above.append(name)
        node = Node(name, tuple((field, self._node(entry)) for field, entry in self.types[name][1]))
        self.above.pop()
        if node.depth > BUDGETS.most_depth:
            raise _too_deep()
        self.done[name] = node
        return node

    def _node(self, entry: Any) -> Node:
        """The tree of a field, from an entry of rosbags' parser. Raises UnknownDefinition."""
        kind, detail = entry[0].name, entry[1]
        if kind == "NAME":
            return self.message(detail)
        if kind == "BASE":
            if detail[0] not in PRIMITIVES and detail[0] not in {"string", "wstring"}:
                raise UnknownDefinition(f"type {detail[0]} is not read")
            return Node(detail[0])
        inner, size = self._node(detail[0]), detail[1]
        if inner.count is not None:
            raise UnknownDefinition("arrays of arrays are not read")
        return Node(inner.name, inner.fields, size if kind == "ARRAY" else -1)


def _too_deep() -> UnknownDefinition:
    """The refusal of types within types within types."""
    return UnknownDefinition(f"its types are nested more than {BUDGETS.most_depth} deep")
