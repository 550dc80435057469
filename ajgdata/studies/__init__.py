"""Studies of the virtual gripper: verification, validation, stability, accuracy and omissions.

Each study is a module with a function `tables(quick)`, which computes the tables of a report page.
Tests assert the same numbers.
"""

#: Source of the row that has the error of all sources together.
ALL_SOURCES = "together"
#: Verdict on a part of the physics that the plan omits.
LEFT_OUT = "left out"
#: Meaning of the time of a simulation, for the notes of tables.
TIMES_NOTE = "Times are CPU times of one thread; other jobs may run at the same time."
