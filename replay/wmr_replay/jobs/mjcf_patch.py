"""MJCF parameters written into a user's robot, or as a fragment to copy from."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from wmr_replay.jobs.mjcf_file import Joints, MjcfFile
from wmr_replay.jobs.mjcf_parameters import MjcfParameters

ROUND = {"cylinder": (0,), "sphere": (0,), "capsule": (0,)}
"""Numbers of a geom's size that are its radius; of an ellipsoid the two largest."""
GRAVITY_MPS2 = 9.81
HEAD = "Written by wmr-replay export: what the model says beyond the simulator that it was held against."


@dataclass
class Patch:
    """Edits of one file; ``beyond`` collects what the file offers no place for."""

    file: MjcfFile
    wanted: MjcfParameters
    joints: Joints | None = None
    beyond: list[tuple[str, str]] = field(default_factory=list)

    def apply(self) -> str:
        """The patched file's text."""
        self.beyond = list(self.wanted.beyond)
        left, right = self.file.wheels(self.joints)
        for joint in (*left, *right):
            self.brake(joint)
        for side, joints in enumerate((left, right)):
            for motor in self.file.motors(joints):
                self.drive(motor, side)
            for joint in joints:
                self.resize(joint, self.wanted.radius[side])
        base = self.file.base_of(left[0])
        self.load(base)
        self.mark(base)
        self.tilt()
        return self.file.text("\n".join(self.comment()))

    def comment(self) -> Iterator[str]:
        """What was changed, and what has no counterpart."""
        yield f"  {HEAD}"
        yield from (f"  {line}" for line in described(self.wanted))
        yield from (f"  no counterpart: {name}: {reason}" for name, reason in self.beyond)

    def brake(self, joint: ET.Element) -> None:
        """Dry and viscous friction of a wheel's joint."""
        wanted = self.wanted
        if wanted.frictionloss_nm:
            before = float(self.file.value(joint, "frictionloss", "0"))
            joint.set("frictionloss", shown(before + wanted.frictionloss_nm))
        if wanted.damping_nm_s or wanted.damping2_nm_s2:
            terms = numbers(self.file.value(joint, "damping", "0"))
            more = (wanted.damping_nm_s, wanted.damping2_nm_s2)
            terms += [0.0] * ((2 if wanted.damping2_nm_s2 else 1) - len(terms))
            summed = [a + b for a, b in zip(terms, (*more, 0.0), strict=False)]
            joint.set("damping", " ".join(map(shown, summed)))

    def drive(self, motor: ET.Element, side: int) -> None:
        """Gear, bias, activation, delay and force range of a motor."""
        wanted, gears = self.wanted, numbers(self.file.value(motor, "gear", "1"))
        before = gears[0]
        if wanted.gear[side] != 1.0:
            motor.set("gear", " ".join(map(shown, [before * wanted.gear[side], *gears[1:]])))
        if wanted.bias_nm[side]:
            motor.tag = "general"
            motor.set("biastype", "affine")
            motor.set("biasprm", f"{shown(wanted.bias_nm[side] / before)} 0 0")
        if wanted.time_constant_s:
            motor.tag = "general"
            motor.set("dyntype", "filterexact")
            motor.set("dynprm", shown(wanted.time_constant_s))
        if wanted.delay_s:
            steps = max(round(wanted.delay_s / self.file.timestep_s), 1)
            motor.set("delay", shown(steps * self.file.timestep_s))
            motor.set("nsample", str(steps + 1))
        if math.isfinite(wanted.limit_nm):
            limit = shown(wanted.limit_nm / abs(before))
            motor.set("forcelimited", "true")
            motor.set("forcerange", f"-{limit} {limit}")

    def resize(self, joint: ET.Element, ratio: float) -> None:
        """Radius and place of a wheel."""
        body = self.file.body_of(joint)
        if self.wanted.track != 1.0:
            x, y, z = numbers(body.get("pos", "0 0 0"))
            body.set("pos", " ".join(map(shown, (x, y * self.wanted.track, z))))
        if ratio == 1.0:
            return
        for geom in body.findall("geom"):
            size = numbers(self.file.value(geom, "size", ""))
            kind = self.file.value(geom, "type", "sphere")
            if kind == "ellipsoid":
                places = tuple(sorted(range(3), key=lambda k: size[k])[1:])
            elif kind in ROUND and size:
                places = ROUND[kind]
            else:
                self.beyond.append(("wheel radius", f"a geom of type {kind} has none"))
                continue
            scaled = [value * ratio if k in places else value for k, value in enumerate(size)]
            geom.set("size", " ".join(map(shown, scaled)))

    def load(self, base: ET.Element) -> None:
        """A weight on the base body."""
        mass, inertial = self.wanted.payload_kg, base.find("inertial")
        if not mass:
            return
        if inertial is not None:
            inertial.set("mass", shown(float(inertial.get("mass", "0")) + mass))
        elif mass < 0:
            self.beyond.append(("payload", f"{-mass:.4g} kg less: take it off the masses of the base body"))
        else:
            weight = {"name": "payload", "type": "sphere", "size": "0.02", "mass": shown(mass)}
            place = " ".join(map(shown, self.centre(base)))
            ET.SubElement(base, "geom", weight | {"pos": place, "contype": "0", "conaffinity": "0"})

    def centre(self, base: ET.Element) -> list[float]:
        """Centre of mass of the body's geoms that state a mass; its origin where none does."""
        found = [(numbers(g.get("pos", "0 0 0")), float(g.get("mass", "0"))) for g in base.findall("geom")]
        total = sum(mass for _, mass in found)
        if total <= 0:
            return [0.0, 0.0, 0.0]
        return [sum(place[k] * mass for place, mass in found) / total for k in range(3)]

    def mark(self, base: ET.Element) -> None:
        """A site with the measured pose."""
        x, y = self.wanted.site_m
        if (x, y) == (0.0, 0.0) and self.wanted.site_rad == 0.0:
            return
        half = self.wanted.site_rad / 2
        turned = f"{shown(math.cos(half))} 0 0 {shown(math.sin(half))}"
        place = {"name": "measured pose", "pos": f"{shown(x)} {shown(y)} 0", "quat": turned}
        ET.SubElement(base, "site", place)

    def tilt(self) -> None:
        """Gravity along the ground."""
        x, y = self.wanted.gravity_mps2
        if (x, y) == (0.0, 0.0):
            return
        option = self.file.option()
        before = numbers(option.get("gravity", f"0 0 -{GRAVITY_MPS2}"))
        option.set("gravity", " ".join(map(shown, (before[0] + x, before[1] + y, before[2]))))


def numbers(text: str) -> list[float]:
    """The numbers of an attribute."""
    return [float(part) for part in text.split()]


def shown(value: float) -> str:
    """A number with the digits that an interval ever justifies."""
    return f"{value:.8g}"


def described(wanted: MjcfParameters) -> Iterator[str]:
    """The parameters in words, with their units."""
    for name in wanted.changed:
        value = getattr(wanted, name)
        sides = f"left {value[0]:.6g}, right {value[1]:.6g}" if isinstance(value, tuple) else f"{value:.6g}"
        yield f"{name}: {sides}"
    yield from (f"note: {note}" for note in wanted.notes)


def patched(path: Path, wanted: MjcfParameters, joints: Joints | None) -> str:
    """The user's MJCF with the parameters in it. Raises InvalidFile, InvalidSetting."""
    return Patch(MjcfFile.read(path), wanted, joints).apply()


TEMPLATE = """<mujoco>
  <worldbody>
    <body name="base">
      <freejoint/>
      <body name="left wheel"><joint name="left"/></body>
      <body name="right wheel"><joint name="right"/></body>
    </body>
  </worldbody>
  <actuator>
    <motor name="left" joint="left"/>
    <motor name="right" joint="right"/>
  </actuator>
</mujoco>
"""


def fragment(wanted: MjcfParameters) -> str:
    """The parameters in a robot without geometry, to copy from; sizes of wheels stand in the comment."""
    root = ET.fromstring(TEMPLATE)
    file = MjcfFile(Path("fragment"), root, {child: parent for parent in root.iter() for child in parent})
    return Patch(file, wanted).apply()
