"""Postures of closed chains that are best in some sense: inverse kinematics by tasks, static equilibrium."""
