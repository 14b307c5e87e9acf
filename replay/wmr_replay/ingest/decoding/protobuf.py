"""The layout of protobuf messages: the wire format, with fields from a FileDescriptorSet.

Tags, lengths and the continuation bits of varints make the skeleton. A field that is absent has its
default, zero.
"""

from functools import lru_cache

from google.protobuf.descriptor import Descriptor, FieldDescriptor
from google.protobuf.descriptor_pb2 import FieldDescriptorProto as Proto
from google.protobuf.descriptor_pb2 import FileDescriptorProto, FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import DecodeError

from wmr_replay.ingest.budgets import BUDGETS, no_account
from wmr_replay.ingest.decoding.layout import Layout, Leaf, Spend, Text, Undecodable
from wmr_replay.ingest.decoding.ros_definitions import UnknownDefinition

_VARINT, _BYTES = 0, 2
_FIXED_BYTES = {1: 8, 5: 4}
"""Wire types of numbers of fixed size."""
_VARINT_BYTES = 10
_FIXED: dict[int, str] = {
    Proto.TYPE_DOUBLE: "<f8",
    Proto.TYPE_FLOAT: "<f4",
    Proto.TYPE_FIXED64: "<u8",
    Proto.TYPE_SFIXED64: "<i8",
    Proto.TYPE_FIXED32: "<u4",
    Proto.TYPE_SFIXED32: "<i4",
}
_ZIGZAG = {Proto.TYPE_SINT32, Proto.TYPE_SINT64}
_NO_NUMBER = {Proto.TYPE_STRING, Proto.TYPE_BYTES, Proto.TYPE_MESSAGE, Proto.TYPE_GROUP}


@lru_cache(maxsize=64)
def parse_descriptor(name: str, data: bytes) -> Descriptor:
    """The message type ``name`` of a serialised FileDescriptorSet. Raises UnknownDefinition."""
    try:
        files = {file.name: file for file in FileDescriptorSet.FromString(data).file}
        pool = DescriptorPool()
        for file in _dependencies_first(files):
            pool.AddSerializedFile(files[file].SerializeToString())
        return pool.FindMessageTypeByName(name)
    except (DecodeError, TypeError, KeyError, RecursionError) as error:
        raise UnknownDefinition(
            f"its protobuf descriptors do not describe {name} ({str(error)[:60]})"
        ) from None


def _dependencies_first(files: dict[str, FileDescriptorProto]) -> list[str]:
    """The files' names in an order in which each follows its dependencies. Raises RecursionError."""
    done: dict[str, None] = {}
    above: set[str] = set()

    def visit(name: str) -> None:
        if name not in files or name in done or name in above:
            return
        if len(above) > BUDGETS.most_depth:
            raise RecursionError("files depend on each other too deeply")
        above.add(name)
        for other in files[name].dependency:
            visit(other)
        above.remove(name)
        done[name] = None

    for name in files:
        visit(name)
    return list(done)


def has_field(descriptor: Descriptor, path: str) -> bool:
    """Whether a dotted path leads to a field; repeated fields at its end only."""
    *stems, last = path.split(".")
    for step in stems:
        field = descriptor.fields_by_name.get(step)
        if field is None or field.message_type is None or field.is_repeated:
            return False
        descriptor = field.message_type
    return last in descriptor.fields_by_name


def protobuf_layout(descriptor: Descriptor, message: bytes, spend: Spend = no_account) -> Layout:
    """Walk one message. Raises Undecodable when it is no such message, OverBudget."""
    layout = Layout(message, absent_is_zero=True, spend=spend)
    _Walk(layout).message(descriptor, "", 0, len(message))
    return layout


class _Walk:
    """One walk over one message's wire format, which fills in a layout."""

    def __init__(self, layout: Layout) -> None:
        self.layout, self.data = layout, layout.exemplar
        self.position = 0

    def message(self, descriptor: Descriptor, path: str, start: int, stop: int) -> None:
        """Walk over all fields between two byte offsets. Raises Undecodable."""
        if path.count(".") >= BUDGETS.most_depth:
            raise Undecodable("nested too deeply")
        self.position = start
        while self.position < stop:
            self.layout.spend(1)
            tag = self._fixed_varint(stop)
            field = descriptor.fields_by_number.get(tag >> 3)
            name = "" if field is None else f"{path}.{field.name}" if path else field.name
            if tag & 7 == _BYTES:
                end = self._fixed_varint(stop) + self.position
                if end > stop:
                    raise Undecodable(f"{name or 'a field'}: {end - stop} bytes beyond the end")
                self._bytes(field, name, self.position, end)
                self.position = end
            else:
                leaf = self._number(tag & 7, field, stop)
                if field is not None:
                    self._put(name, field, leaf)

    def _bytes(self, field: FieldDescriptor | None, name: str, start: int, stop: int) -> None:
        """Enter a field with a length: a message, a string, or packed numbers."""
        if field is None:
            return
        if field.type == Proto.TYPE_MESSAGE and field.message_type is not None:
            self.message(field.message_type, self._indexed(name, field), start, stop)
        elif field.type == Proto.TYPE_STRING:
            content = self.data[start:stop].decode(errors="replace")
            self.layout.texts[self._indexed(name, field)] = Text(start, content, stop - start)
        elif field.type in _FIXED:
            size = int(_FIXED[field.type][2])
            self._row(name, Leaf(start, _FIXED[field.type], (stop - start) // size, size))
        elif field.type not in _NO_NUMBER:
            self.position = start
            while self.position < stop:
                self.layout.spend(1)
                self._put(name, field, self._number(_VARINT, field, stop))

    def _row(self, name: str, row: Leaf) -> None:
        """A packed array of numbers of fixed size, perhaps in several pieces."""
        self.layout.spend(row.count)
        first = self.layout.counts.get(name, 0)
        self.layout.counts[name] = first + row.count
        for k in range(row.count):
            self.layout.leaves[f"{name}[{first + k}]"] = row.item(k)

    def _put(self, name: str, field: FieldDescriptor, leaf: Leaf) -> None:
        """Enter the leaf of a field at its path."""
        self.layout.leaves[self._indexed(name, field)] = leaf

    def _indexed(self, name: str, field: FieldDescriptor) -> str:
        """The path, with the next index for a repeated field."""
        if not field.is_repeated:
            return name
        k = self.layout.counts.get(name, 0)
        self.layout.counts[name] = k + 1
        return f"{name}[{k}]"

    def _number(self, wire_type: int, field: FieldDescriptor | None, stop: int) -> Leaf:
        """The leaf of a number, moved past. Raises Undecodable."""
        start = self.position
        if wire_type == _VARINT:
            size, dtype = self._varint_bytes(stop), "varint"
            self.layout.fix(start, start + size, 0x80)
        elif wire_type in _FIXED_BYTES:
            size = _FIXED_BYTES[wire_type]
            dtype = f"<u{size}"
        else:
            raise Undecodable(f"wire type {wire_type}")
        if start + size > stop:
            raise Undecodable(f"the message ends inside a number at byte {start}")
        self.position = start + size
        return Leaf(start, dtype if field is None else _declared(field, dtype), 1, size)

    def _varint_bytes(self, stop: int) -> int:
        """Length in bytes of the varint at the present position. Raises Undecodable."""
        for size in range(1, _VARINT_BYTES + 1):
            if self.position + size > stop:
                break
            if self.data[self.position + size - 1] < 0x80:
                return size
        raise Undecodable(f"a number without an end at byte {self.position}")

    def _fixed_varint(self, stop: int) -> int:
        """A tag or a length: its bytes belong to the skeleton."""
        start, size = self.position, self._varint_bytes(stop)
        self.layout.fix(start, start + size)
        self.position = start + size
        return sum((byte & 0x7F) << (7 * k) for k, byte in enumerate(self.data[start : start + size]))


def _declared(field: FieldDescriptor, dtype: str) -> str:
    """The number's type by its declaration, which must agree with the one on the wire."""
    declared = _FIXED.get(field.type, "zigzag" if field.type in _ZIGZAG else "varint")
    if (declared in {"varint", "zigzag"}) != (dtype == "varint") or (
        dtype != "varint" and declared[-1] != dtype[-1]
    ):
        raise Undecodable(f"{field.name} is declared {declared} and written {dtype}")
    return declared
