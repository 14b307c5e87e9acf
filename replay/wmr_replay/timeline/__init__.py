"""Results as timelines in Rerun; the only package that knows Rerun.

Every temporal row lies on two timelines: ``log_t``, the duration since the log's first pose, and ``stamp``,
the header's stamp. What *describes* an instant (velocities, C_k, C_d and their thresholds) lies at the
instant that it describes, t − ``delay_s``, so that estimate and truth lie over one another. What is *decided*
(mode, status, α) lies at the time t at which it was known, so that the delay of a detection can be seen.

================================================  ===========================================================
``/description``, ``/how_to_read``                what the run found; how to read it (markdown, static)
``/findings``                                     what is wrong with the data, where each finding begins
``/path/estimated``, ``/path/true``               the measured path, coloured by mode; the true path
``/path/robot``, ``/path/robot/velocity``         the robot at the cursor: pose, and velocity in its frame
``/path/grid``                                    a grid in metres (static)
``/mode/estimated``, ``/mode/true``, ``/status``  mode and status changes, each at its exact row
``/mode/hindsight``                               the mode as the whole log shows it
``/posterior``, ``/posterior/both``               probabilities of ideal, skidding, slipping; of both at once
``/pose/Q/measured``, ``/pose/yaw_rad/true``      Q is ``x_m``, ``y_m``, ``yaw_rad``
``/velocity/Q/estimate``, ``/velocity/Q/true``    Q is ``v_long_mps``, ``v_lat_mps``, ``yaw_rate_radps``
``/constraint/Q/estimate``, ``…/Q/threshold``     Q is ``c_k_mps``, ``c_d_mps2``; ± threshold
``/alpha/estimate``, ``…/band``, ``…/nominal``    α, α ± 1.96 standard deviations; the nominal value
``/torque``                                       left and right wheel torque
``/slip/S/estimate``, ``/slip/S/band``            slip velocity of a wheel, ± 1.96 sd; S is a side
``/learnt/Q/estimate``, ``…/band``, ``…/stated``  Q: what was learnt of the wheels, such as ``wheel_scale``
================================================  ===========================================================

Every view opens on the whole log. Recordings of comparisons and gap analyses: ``comparison``, ``gap``.
"""
