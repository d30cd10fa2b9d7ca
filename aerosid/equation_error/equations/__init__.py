"""The kinematic and coefficient equations of a record, in the band of its motion."""
