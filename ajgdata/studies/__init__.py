"""Studies of the virtual gripper: how right it is, how stable, how fast, and what it leaves out.

Each module makes tables of figures computed in the run; tests assert them, the report shows them.
"""

#: Source of the row that has the error of all sources together.
ALL_SOURCES = "together"
#: Verdict on a part of the physics that the plan omits.
LEFT_OUT = "left out"
#: What is meant by the time of a simulation, in the words of the tables.
TIMES_NOTE = "Times are CPU times of one thread; other jobs may run at the same time."
