"""ROS bags that are no MCAP files, ROS 2's SQLite form and ROS 1's, presented as spans of MCAP records.

Each span of such a file becomes the message records that an MCAP chunk would hold. The walk over records, the
decoders and everything behind them are those of MCAP files, so a message gives the same columns wherever it
was recorded.
"""
