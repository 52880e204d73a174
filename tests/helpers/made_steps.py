"""Two footsteps: a normal one, and one whose first peak is an impact."""

from underfoot.floor.footsteps import Step

STEP = Step(1, "t1", "left", 0.2, 612.4, 760.2, 500.0, 740.0, 320.04, 8.61, 210.0, 200.0, person=2)
SPIKE = Step(2, "t2", "unknown", 0.8, 604.0, 1074.0, 465.0, 942.0, 413.8, 159.0, float("nan"), 180.0, spike=True)
