"""Known cases of the virtual gripper: one class for each claim whose exact result is known."""
