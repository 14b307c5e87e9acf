"""Results as timelines in Rerun; the only package that knows Rerun.

Every temporal row lies on two timelines: ``log_t``, the duration since the log's first pose, and ``stamp``,
the header's stamp. What *describes* an instant (velocities, C_k, C_d and their thresholds) lies at the
instant that it describes, t − ``delay_s``, so that estimate and truth lie over one another. What is *decided*
(mode, status, α) lies at the time t at which it was known, so that the delay of a detection can be seen.

=============================================  ==============================================================
``/description``                               what the run found and how to read it (markdown, static)
``/path/estimated``, ``/path/true``            the measured path, coloured by estimated mode; the true path
``/path/robot``, ``/path/grid``                where the robot is at the cursor; a grid in metres (static)
``/mode/estimated``, ``/mode/true``            mode changes, each at its exact row
``/status``                                    status changes, each at its exact row
``/pose/`` ``x_m  y_m  yaw_rad``               as measured; the truth under ``/pose/true/``
``/velocity/`` ``v_long_mps  v_lat_mps``       estimates, and ``yaw_rate_radps``; the truth under
                                               ``/velocity/true/``
``/constraint/`` ``c_k_mps  c_d_mps2``         the constraints, and ``c_k_threshold_mps``,
                                               ``c_d_threshold_mps2`` (two lines each: ±)
``/alpha/`` ``estimate  band  nominal``        α, α ± 1.96 standard deviations (two lines), the nominal value
=============================================  ==============================================================
"""

from wmr_replay.timeline.viewer import ViewerUnavailable, open_viewer, viewer_command
from wmr_replay.timeline.writer import Timeline

__all__ = ["Timeline", "ViewerUnavailable", "open_viewer", "viewer_command"]
