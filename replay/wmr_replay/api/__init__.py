"""The public interface: one function a task, one result object an answer.

``import wmr_replay as wr`` offers everything of this room by name and imports it on first use. The command
line parses its arguments, calls these functions and prints what they return.

======================  =====================================================================================
module                  holds
======================  =====================================================================================
``run``, ``result``     ``run`` and ``replay``, and the result that both return
``log``, ``info``       ``open_log``: signals as frames, and what a log holds
``gap``, ``fit``        what a model lacks; a robot's base model
``differentiate``       derivatives of arrays; ``design`` of a kernel; ``pose_derivatives`` of a log
``synthesise``          synthetic logs; ``simulation``: robot, sensors, world; ``suite``: sets of logs
``compare``, ``check``  two results side by side; results against references
``batch``, ``convert``  many logs into one dataset; a CSV file as a log
``viewer``              timelines in the viewer, in a browser, as pictures

``stored``              reports and pictures of stored results
``plots``, ``html``     pictures (matplotlib, extra ``plot``), and the card of a result in notebooks
``places``, ``request`` paths and URLs; settings, models and mappings as callers give them
``store``, ``names``    where samples are kept; modes by name
======================  =====================================================================================

Only this room and ``gap`` may import the simulator: for ``synthesise``, ``convert`` and ``suite``.
"""
