"""Reading and writing chains: URDF with a closures file, MJCF, SDF, robot.yaml."""
