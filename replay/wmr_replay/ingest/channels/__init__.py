"""Which channel serves as pose, torque or truth, in which frame and by which clock."""
