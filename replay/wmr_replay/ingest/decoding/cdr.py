"""The layout of ROS messages: ROS 2's plain CDR (OMG DDS-XTypes 7.4), versions 1 and 2, both byte orders, and
ROS 1's wire form, which is the same without header, alignment and closing zeros.
"""

from contextlib import suppress

from wmr_replay.ingest.budgets import no_account
from wmr_replay.ingest.decoding.layout import Layout, Leaf, Spend, Text, Undecodable
from wmr_replay.ingest.decoding.ros_definitions import PRIMITIVES, Node

_HEADER_BYTES = 4
_KINDS = {0: (">", 8), 1: ("<", 8), 6: (">", 4), 7: ("<", 4)}
"""Representation identifier → byte order and largest alignment."""
_WIDE_BYTES = (4, 2, 1)
"""Bytes for each one of a wide string's length: its characters of 4 or 2 bytes are counted, or its bytes."""
_PADDING_BYTES = 4


def cdr_layout(definition: Node, message: bytes, spend: Spend = no_account) -> Layout:
    """Walk one message. Raises Undecodable when it does not fit its definition, OverBudget."""
    if len(message) < _HEADER_BYTES or message[0] != 0 or message[1] not in _KINDS:
        raise Undecodable("no plain CDR header")
    walks = [_Walk(message, spend, *_KINDS[message[1]], _HEADER_BYTES, unit) for unit in _WIDE_BYTES]
    layout = _by_length(walks, definition) if definition.is_wide else walks[0].run(definition)
    layout.fix(0, 2)
    return layout


def _by_length(walks: "list[_Walk]", definition: Node) -> Layout:
    """The only way of reading wide strings that leads to the message's end. Raises Undecodable."""
    found: list[Layout] = []
    for walk in walks:
        with suppress(Undecodable):
            layout = walk.run(definition)
            if walk.n_left < _PADDING_BYTES and all(layout.leaves != other.leaves for other in found):
                found.append(layout)
    if len(found) != 1:
        raise Undecodable(f"its wide strings can be read in {len(found)} ways")
    return found[0]


def ros1_layout(definition: Node, message: bytes, spend: Spend = no_account) -> Layout:
    """Walk one message of ROS 1. Raises Undecodable when it does not fit its definition, OverBudget."""
    return _Walk(message, spend, "<", 1, 0).run(definition)


class _Walk:
    """One walk over one message, field after field, which fills in a layout."""

    def __init__(
        self, message: bytes, spend: Spend, order: str, max_alignment: int, start: int, wide: int = 1
    ) -> None:
        self.order, self.max_alignment, self.wide_bytes = order, max_alignment, wide
        self.message, self.position = message, start
        self.layout = Layout(message, spend=spend)

    def run(self, definition: Node) -> Layout:
        """The layout of the message. Raises Undecodable."""
        self._node(definition, "")
        return self.layout

    @property
    def n_left(self) -> int:
        """Number of bytes behind the last field."""
        return len(self.message) - self.position

    def _node(self, node: Node, path: str) -> None:
        """Walk over one field of any type."""
        self.layout.spend(1)
        if node.count is not None:
            self._repeated(Node(node.name, node.fields), node.count, path)
        elif node.fields is not None:
            self._struct(node.fields, path)
        elif node.name in PRIMITIVES:
            self.layout.leaves[path] = self._numbers(node.name, 1)
        elif node.name == "string":
            self._string(path)
        elif node.name == "wstring":
            self._advance(1, self._length() * self.wide_bytes)
        else:
            raise Undecodable(f"{path}: {node.name} has no fixed form in CDR")

    def _struct(self, fields: tuple[tuple[str, Node], ...], path: str) -> None:
        """Walk over the fields of a message type."""
        if not fields and self.max_alignment > 1:
            self._advance(1, 1)  # an empty message carries one dummy byte
        for name, node in fields:
            self._node(node, f"{path}.{name}" if path else name)

    def _repeated(self, item: Node, count: int, path: str) -> None:
        """Walk over an array, or a sequence (``count`` −1)."""
        if count < 0:
            count = self._length()
        self.layout.counts[path] = count
        if count > len(self.message) - self.position:
            raise Undecodable(f"{path}: {count} elements in {len(self.message) - self.position} bytes")
        if item.name in PRIMITIVES:
            if count:
                self.layout.leaves[path] = self._numbers(item.name, count)
            return
        for k in range(count):
            self._node(item, f"{path}[{k}]")

    def _numbers(self, name: str, count: int) -> Leaf:
        """The leaf of ``count`` numbers of a primitive type."""
        size = int(PRIMITIVES[name][1])
        return Leaf(self._advance(size, size * count), self.order + PRIMITIVES[name], count, size)

    def _string(self, path: str) -> None:
        """Enter a string and its place."""
        length = self._length()
        start = self._advance(1, length)
        content = self.message[start : start + length].removesuffix(b"\0")
        self.layout.texts[path] = Text(start, content.decode(errors="replace"), length)

    def _length(self) -> int:
        """Read a length of 32 bits, which joins the skeleton."""
        start = self._advance(4, 4)
        self.layout.fix(start, start + 4)
        return int.from_bytes(self.message[start : start + 4], "little" if self.order == "<" else "big")

    def _advance(self, alignment: int, n_bytes: int) -> int:
        """Start of the next ``n_bytes``, aligned; moves behind them."""
        start = self.position + (_HEADER_BYTES - self.position) % min(alignment, self.max_alignment)
        if start + n_bytes > len(self.message):
            raise Undecodable(f"{n_bytes} bytes wanted at {start}, the message has {len(self.message)}")
        self.position = start + n_bytes
        return start
