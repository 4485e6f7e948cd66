"""Reference trajectories: orientation, angular velocity and angular acceleration at any time."""
