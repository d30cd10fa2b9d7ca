"""Linear models of the declared and the completed aircraft, and the levels of flying qualities of their modes."""
