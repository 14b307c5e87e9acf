"""A user's MJCF file: its wheels, motors and base body, and attributes with the defaults of their classes."""

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from wmr_schemas.errors import InvalidFile, InvalidSetting

ACTUATORS = ("motor", "general")
"""Actuators whose control is a torque; in defaults, each of them speaks for the other."""
SIDES = ("left", "right")
TIMESTEP_S = 0.002
"""MuJoCo's own."""
Joints = tuple[tuple[str, ...], tuple[str, ...]]


@dataclass(frozen=True, eq=False)
class MjcfFile:
    """The parsed file, with the parent of each element."""

    path: Path
    root: ET.Element
    parents: dict[ET.Element, ET.Element]

    @classmethod
    def read(cls, path: Path) -> "MjcfFile":
        """Read the file; comments are kept. Raises InvalidFile."""
        parser = ET.XMLParser(target=ET.TreeBuilder(insert_comments=True))
        try:
            root = ET.parse(path, parser).getroot()
        except OSError as error:
            raise InvalidFile(path, "", f"cannot be read ({error.strerror})") from None
        except ET.ParseError as error:
            raise InvalidFile(path, "", f"is not XML: {error}") from None
        if root.tag != "mujoco":
            raise InvalidFile(path, f"<{root.tag}>", "expected <mujoco>")
        return cls(path, root, {child: parent for parent in root.iter() for child in parent})

    @property
    def timestep_s(self) -> float:
        """Of the simulation."""
        option = self.root.find("option")
        return float((option.get("timestep") if option is not None else None) or TIMESTEP_S)

    def option(self) -> ET.Element:
        """``<option>``, made where there is none."""
        found = self.root.find("option")
        if found is None:
            found = ET.Element("option")
            self.root.insert(0, found)
        return found

    def wheels(self, joints: Joints | None) -> tuple[list[ET.Element], list[ET.Element]]:
        """Joints of the wheels, left and right: those named, else those with left or right in their names.

        Raises InvalidSetting where a side has none.
        """
        named = [joint for joint in self.root.iter("joint") if joint.get("name") and self.in_world(joint)]
        if joints is None:
            sides = [[j for j in named if side in str(j.get("name")).lower()] for side in SIDES]
        else:
            sides = [[j for j in named if j.get("name") in side] for side in joints]
        for side, found in zip(SIDES, sides, strict=True):
            if not found:
                known = ", ".join(str(joint.get("name")) for joint in named) or "none"
                raise InvalidSetting(
                    f"{self.path} has no joint of a {side} wheel; its joints are {known}: name them with "
                    "--joints LEFT,…:RIGHT,…"
                )
        return sides[0], sides[1]

    def in_world(self, element: ET.Element) -> bool:
        """Whether the element stands in a body, not in defaults or an equality."""
        return self.parents[element].tag == "body"

    def body_of(self, joint: ET.Element) -> ET.Element:
        """The body that a joint moves."""
        return self.parents[joint]

    def base_of(self, joint: ET.Element) -> ET.Element:
        """The body with the free joint above a wheel; else the body that the wheel hangs on."""
        above = list(self.bodies_above(self.body_of(joint)))
        for body in above:
            free = body.find("freejoint") is not None
            if free or any(child.get("type") == "free" for child in body.findall("joint")):
                return body
        return above[0] if above else self.body_of(joint)

    def bodies_above(self, body: ET.Element) -> Iterator[ET.Element]:
        """The bodies that a body hangs on, from the next one up."""
        while (body := self.parents[body]).tag == "body":
            yield body

    def motors(self, joints: list[ET.Element]) -> list[ET.Element]:
        """Actuators of the joints whose control is a torque."""
        names = {joint.get("name") for joint in joints}
        found = [one for section in self.root.findall("actuator") for one in section]
        return [one for one in found if one.tag in ACTUATORS and one.get("joint") in names]

    def value(self, element: ET.Element, attribute: str, default: str) -> str:
        """The element's attribute, else that of its default class and those above it."""
        own = element.get(attribute)
        if own is not None:
            return own
        tags = ACTUATORS if element.tag in ACTUATORS else (element.tag,)
        for settings in self.defaults(self.class_of(element)):
            for tag in tags:
                child = settings.find(tag)
                if child is not None and (found := child.get(attribute)) is not None:
                    return found
        return default

    def class_of(self, element: ET.Element) -> str | None:
        """Name of the element's default class; None: the main one."""
        if (own := element.get("class")) is not None:
            return own
        while (parent := self.parents.get(element)) is not None:
            element = parent
            if (inherited := element.get("childclass")) is not None:
                return inherited
        return None

    def defaults(self, name: str | None) -> Iterator[ET.Element]:
        """``<default>`` of a class, and those around it up to the main one."""
        found: ET.Element | None = self.root.find("default")
        for one in self.root.iter("default"):
            if name is not None and one.get("class") == name:
                found = one
        while found is not None and found.tag == "default":
            yield found
            found = self.parents.get(found)

    def text(self, comment: str) -> str:
        """The file's XML with a comment at its top."""
        head = ET.Comment(f"\n{comment}\n")
        head.tail = "\n  "
        self.root.insert(0, head)
        ET.indent(self.root)
        return ET.tostring(self.root, encoding="unicode") + "\n"
