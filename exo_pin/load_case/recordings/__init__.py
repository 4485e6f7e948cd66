"""Records of movement in other programs' files and conventions, and the one gate that all of them pass."""
