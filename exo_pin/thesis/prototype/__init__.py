"""Chapter 5: the test rig and the prototype."""
