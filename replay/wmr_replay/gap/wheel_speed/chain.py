"""Where short stretches have commands and measured wheel speeds: wheels → path, commands → wheels, and both
together.

A lag of half a stretch turns the robot as little as a wide track does. Measured wheel speeds tell what the
chassis makes of them, whatever the drive does, and what the drive makes of commands. What both show is then
fitted to the path together, and has to pass as anything else.
"""

from wmr_replay.gap.wheel_speed.candidates import PLACES, candidates_of, parameters_of
from wmr_replay.gap.wheel_speed.drive_fit import drive_of
from wmr_replay.gap.wheel_speed.estimate import fit
from wmr_replay.gap.wheel_speed.predict import Problem
from wmr_replay.gap.wheel_speed.select import Search, Selection


def chassis_and_drive(problem: Problem, rolled: Selection) -> Search:
    """Where a search by commands begins: with the lasting effects of ``rolled``, which measured wheel speeds
    show, and those of the drive that the wheels show.
    """
    candidates = candidates_of(problem.record)
    commanded = tuple(one for one in candidates if one.needs_commands)
    drive = drive_of(problem, rolled.problem.record, commanded, problem.settings.drive)
    lasting = [one.name for one in candidates if one.name not in PLACES and one.name in rolled.fit.values]
    values = {**drive, **{name: rolled.fit.values[name] for name in lasting if name not in drive}}
    parameters = tuple(one for name in values for one in parameters_of(name))
    together = fit(problem, parameters, values)
    return Search(problem, together, candidates, [], tuple(values))
