"""Contact modes between tyre and road, and sets of them.

Both are integers: they serve in arrays, in tables and inside compiled code (numba takes members of an IntEnum
as integers; a ModeSet enters compiled code as ``int(ModeSet.…)``).
"""

from enum import IntEnum, IntFlag


class ContactMode(IntEnum):
    """Discrete state q of the switched model (Yu, Barbot, Floquet 2009, §3.1); 3 is both at once.

    ``UNDECIDED`` stands in estimates only, where no mode can be named.
    """

    UNDECIDED = -1
    IDEAL = 0
    SKIDDING = 1
    SLIPPING = 2
    SKIDDING_SLIPPING = 3

    @property
    def label(self) -> str:
        """The name on screen and in column names, such as ``skidding_slipping``."""
        return self.name.lower()

    @property
    def bit(self) -> "ModeSet":
        """The set that holds this mode alone. Raises ValueError for an undecided mode."""
        if self < 0:
            raise ValueError("an undecided mode has no bit")
        return ModeSet(1 << int(self))


class ModeSet(IntFlag):
    """Modes that are not excluded; bit k stands for mode k. ``IDEAL | SLIPPING`` is "not skidding"."""

    IDEAL = 0b0001
    SKIDDING = 0b0010
    SLIPPING = 0b0100
    SKIDDING_SLIPPING = 0b1000
    ALL_SINGLE = 0b0111
    """Nothing is excluded, and skidding-and-slipping is not a mode of its own."""
    ALL = 0b1111
    """Nothing is excluded, and skidding-and-slipping is a mode of its own."""


MODES = (ContactMode.IDEAL, ContactMode.SKIDDING, ContactMode.SLIPPING, ContactMode.SKIDDING_SLIPPING)
"""The modes that can occur, in the order of their values."""
