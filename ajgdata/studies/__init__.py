"""Studies of the virtual gripper: how right it is, how stable, how fast, and what it leaves out.

Each module makes tables of figures computed in the run; tests assert them, the report shows them.
"""
