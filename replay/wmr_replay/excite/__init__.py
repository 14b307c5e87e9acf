"""What to drive next: a drive that tells rival effects apart, within a robot's bounds.

Pure: it knows no file and no terminal. :mod:`.manoeuvres` offers pieces of a drive, :mod:`.information` says
what each piece would show of every effect, :mod:`.design` puts a drive together.
"""

from wmr_replay.excite.bounds import Bounds
from wmr_replay.excite.design import Design, design
from wmr_replay.excite.question import Question

__all__ = ["Bounds", "Design", "Question", "design"]
