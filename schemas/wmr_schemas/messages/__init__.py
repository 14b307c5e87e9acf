"""Message definitions of the canonical log, and vectorised encoders for its three encodings.

:mod:`~wmr_schemas.messages.ros2` writes ROS 2 CDR, :mod:`~wmr_schemas.messages.proto` protobuf,
:mod:`~wmr_schemas.messages.jsonmsg` JSON. Each turns whole columns into messages.
"""

POSE_TOPIC = "/pose"
TORQUE_TOPIC = "/wheel_torques"
WHEEL_TOPIC = "/wheel_speeds"
COMMAND_TOPIC = "/wheel_commands"
TWIST_TOPIC = "/cmd_vel"
STEERING_TOPIC = "/steering"
MODE_TOPIC = "/ground_truth/mode"
METADATA_NAME = "wmr_replay"
POSE_FRAME = "map"
ROBOT_FRAME = "base_link"
WHEEL_JOINTS = ("left_wheel_joint", "right_wheel_joint")
STEERING_JOINTS = ("steering_joint",)
