"""Gap and calibration of robots whose base model wheel speeds drive.

The motion follows from the wheels kinematically, so that no filter is needed: the measured path is unrolled
into the frame of the body, where ahead, left and yaw are three separate series, and every effect is a column
beside them. What remains are errors of known structure: white noise of the pose, and slip velocities that
are integrated.
"""
