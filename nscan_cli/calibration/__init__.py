"""What the scans say about the robot and its file: steps by scans against steps by odometry."""
