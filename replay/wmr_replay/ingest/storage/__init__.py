"""Where the bytes of a log lie: files, rosbag2 directories, URLs read by ranges, blocks read ahead."""
