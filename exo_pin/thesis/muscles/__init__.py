"""Chapter 3 and Appendices A and B: the pneumatic muscle."""
