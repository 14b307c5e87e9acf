"""The four contact modes between tyre and road."""

from enum import IntEnum


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
    def bit(self) -> int:
        """The mode's bit in ``mode_set``."""
        if self < 0:
            raise ValueError("an undecided mode has no bit")
        return 1 << int(self)


MODES = (ContactMode.IDEAL, ContactMode.SKIDDING, ContactMode.SLIPPING, ContactMode.SKIDDING_SLIPPING)
ALL_MODES_SET = 0b111
"""``mode_set`` when nothing is excluded and skidding-and-slipping is not enabled."""
