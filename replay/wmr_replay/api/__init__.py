"""The public interface: one function a task, one result object an answer.

``import wmr_replay as wr`` offers everything of this room by name and imports it on first use. The command
line parses its arguments, calls these functions and prints what they return.

Only this room, ``gap`` and ``cli`` may import the simulator, for :mod:`~wmr_replay.api.synthesise`,
:mod:`~wmr_replay.api.convert` and :mod:`~wmr_replay.api.suite`.
"""
