"""A case simulated on its plant."""

from worlds import plant_one
from worlds.case import Case, World
from worlds.plant_two import effects
from worlds.plant_two import world as plant_two

PLANTS = {1: plant_one.world_of, 2: plant_two.world_of, 3: plant_two.world_of}
SAME_FORM = {1: plant_one.SAME_FORM, 2: effects.SAME_FORM, 3: effects.SAME_FORM - {"input_delay"}}
"""Effects that a plant has in their declared form."""


def simulated(case: Case) -> World:
    """The case's world. Raises RanAway where even a small hidden effect makes the robot unstable."""
    return PLANTS[case.plant](case)
