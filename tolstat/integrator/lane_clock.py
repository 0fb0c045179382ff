"""The clock of each lane: what its trial has come to. One row for each of these."""

from __future__ import annotations

# of a moment, too, which the rates are asked for
TIME = 0  # s
PHASE = 1  # number of the last mark passed; -1 where no trial is

STEP = 2  # s, to be tried next
ROOT = 3  # what `control.step_factor` remembers of the last accepted step
TARGET = 4  # s, the next mark
SMALLEST = 5  # s, a trial that needs shorter steps is given up
COUNT = 6  # of steps tried
TRIED = 7  # s, the step tried last; kept up where samples are taken
ACCEPTED = 8  # whether it was accepted: 1 or 0; kept up there, too
ERROR = 9  # its error, 1 at the tolerance; kept up where something happens
EVENT = 10  # what happened: one of the three below
AFTER = 11  # s, the next step behind a crossing that is aimed at; else 0

MOMENT_ROWS = 2
CLOCK_ROWS = 12

NOTHING = 0.0
MARK_REACHED = 1.0
FAILED = 2.0
