"""Where the bytes of a log lie: files, rosbag2 directories and URLs.

This room holds what knows paths, addresses and the first bytes of a file. It knows no record of MCAP.
"""
