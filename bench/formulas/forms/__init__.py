"""The hidden forms: plain functions of the motion, written without the analysis's dictionary.

Each gives an acceleration in m/s² on one channel: dv_long/dt, or half_track_m · d(yaw_rate)/dt. Sizes are
drawn so that the form accelerates by about .1 to .5 m/s² where the robot drives.

One file a set, named as its part of ``split.toml``.
"""

from formulas.forms.base import At, Form, form
from formulas.forms.develop import DEVELOP
from formulas.forms.earlier import EARLIER
from formulas.forms.eighteenth import EIGHTEENTH
from formulas.forms.eighth import EIGHTH
from formulas.forms.eleventh import ELEVENTH
from formulas.forms.fifteenth import FIFTEENTH
from formulas.forms.fifth import FIFTH
from formulas.forms.fourteenth import FOURTEENTH
from formulas.forms.fourth import FOURTH
from formulas.forms.nineteenth import NINETEENTH
from formulas.forms.ninth import NINTH
from formulas.forms.report import REPORT
from formulas.forms.second import SECOND
from formulas.forms.seventeenth import SEVENTEENTH
from formulas.forms.seventh import SEVENTH
from formulas.forms.sixteenth import SIXTEENTH
from formulas.forms.sixth import SIXTH
from formulas.forms.tenth import TENTH
from formulas.forms.third import THIRD
from formulas.forms.thirteenth import THIRTEENTH
from formulas.forms.twelfth import TWELFTH
from formulas.forms.twentieth import TWENTIETH
from formulas.forms.twentyfirst import TWENTYFIRST

__all__ = [
    "DEVELOP",
    "EARLIER",
    "EIGHTEENTH",
    "EIGHTH",
    "ELEVENTH",
    "FIFTEENTH",
    "FIFTH",
    "FORMS",
    "FOURTEENTH",
    "FOURTH",
    "NINETEENTH",
    "NINTH",
    "ORDER",
    "PLACED",
    "REPORT",
    "SECOND",
    "SEVENTEENTH",
    "SEVENTH",
    "SIXTEENTH",
    "SIXTH",
    "TENTH",
    "THIRD",
    "THIRTEENTH",
    "TWELFTH",
    "TWENTIETH",
    "TWENTYFIRST",
    "At",
    "Form",
    "form",
]

FORMS = (
    DEVELOP
    | EARLIER
    | SECOND
    | THIRD
    | FOURTH
    | FIFTH
    | SIXTH
    | SEVENTH
    | EIGHTH
    | NINTH
    | TENTH
    | ELEVENTH
    | TWELFTH
    | THIRTEENTH
    | FOURTEENTH
    | FIFTEENTH
    | SIXTEENTH
    | SEVENTEENTH
    | EIGHTEENTH
    | NINETEENTH
    | TWENTIETH
    | TWENTYFIRST
    | REPORT
)
ORDER = (
    *sorted(DEVELOP | EARLIER),
    *(*SECOND, *THIRD, *FOURTH, *FIFTH, *SIXTH, *SEVENTH, *EIGHTH, *NINTH, *TENTH, *ELEVENTH, *TWELFTH),
    *(*THIRTEENTH, *FOURTEENTH, *FIFTEENTH, *SIXTEENTH, *SEVENTEENTH, *EIGHTEENTH, *NINETEENTH),
    *(*TWENTIETH, *TWENTYFIRST, *REPORT),
)
"""Place of a form in the seeds' streams; new forms come last, so that logs of the others stay as they are."""
PLACED = (
    *("dome", "round_hill", "ridge", "bowl", "mud_patch", "loading_ramp", "drain", "bungee", "lawn_edge"),
    *("mopped_lane", "thick_rug", "crowned_road", "oil_spill", "saddle", "whirlpool", "helical_ramp"),
    *(
        "carpet_edge",
        "swale",
        "tall_grass",
        "laid_hose",
        "wheel_ruts",
        "loose_sand",
        "garden_hose",
        *("cart_ruts", "floor_dip", "rubber_mat", "roundabout", "whirl", "steel_plate"),
    ),
)
"""Forms whose place and radius are drawn as shares of the area that is driven."""
