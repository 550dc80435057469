"""Studies of the virtual gripper: how right it is, how stable, how fast, and what it leaves out.

Each module makes tables of figures computed in the run; tests assert them, the report shows them.
"""

#: What is meant by the time of a simulation, in the words of the tables.
TIMED = "Times are CPU times of one thread; other jobs may run at the same time."
