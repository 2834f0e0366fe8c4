"""Compiled functions that follow motions from switch to switch.

Terms of this package; docs/glossary.md has the others:

* motion, trajectory: the solution for one point, that is for one set of parameters and initial values
* lane i: the memory of one trajectory, in the arrays w (float64) and k (int64) of lane.py
* batch: the trajectories that are computed together, one in each lane. A batch of switches is applied together
* wait: sticking or resting. slide: sliding up or down. segment: the motion between two switches, in closed form
* record: the excitation periods after the transient. Section points and switches in the record are results
* margin: the smallest distance of any decision from the opposite decision (margins.py)
* budget: the largest cost of an excitation period. Switches and evaluations count (switch.py)
* h: the time since the last switch. A cursor is the h up to which a search has found no zero
* where: a mask. A function changes lane i only if `where` is true
* fast part: the part of a quantity that oscillates with the disturbance, like sin ητ. The rest is the slow part
* literal: an argument whose value is inserted when a function is compiled
* shape: a function of h of the form c0 + c1 h + c2 h² + α sin h + β vers h + fast part (motion.py)
"""
