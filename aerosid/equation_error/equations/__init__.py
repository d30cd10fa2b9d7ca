"""The kinematic and coefficient equations of a recording, in the band of its motion."""
