"""Rigid-body flight model: axes, equations of motion with their exact Jacobians, sensors."""
