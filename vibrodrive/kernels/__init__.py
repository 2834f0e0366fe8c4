"""Compiled functions that follow motions from switch to switch.

Terms of this package; docs/glossary.md has the others:

* motion, trajectory: the solution for one point, that is for one set of parameters and initial values
* lane i: the memory of one trajectory, in the arrays w (float64) and k (int64) of lane.py
* batch: the trajectories that are computed together, one in each lane. batch of switches: the switches that one pass
  of the loop in engine.py applies in these lanes
* decision: the choice of the next state at a switch. It depends on H, or on the sign of ξ at the end of a slide down
* wait: sticking or resting. slide: sliding up or down. segment: the motion between two switches, in closed form. A
  state of long duration is divided into several segments (motion.py)
* departure: a switch at which the mass leaves the obstacle. reference: the state at an earlier departure, with which
  the state at each departure is compared (recurrence.py)
* scan: the search of Muller's method and of `fixed`. It goes along the grid up to the first change of sign
* period, phase: the time τ is 2π · period + φ + low, with an integer period, the phase φ in [0, 2π), and `low`, which
  is below the last bit of φ. θ is ητ mod 2π
* record: the excitation periods after the transient. Section points and switches in the record are results
* margin: the smallest distance of any decision from the opposite decision (margins.py)
* budget: the largest cost of an excitation period. A switch costs 1, an evaluation in a search much less (switch.py)
* h: the time since the last switch. A cursor is the h up to which a search has found no zero
* outcome: the result of a search so far (codes.py). arrival: motion and excitation at a time h (`Arrival` in motion.py)
* where: a mask. A function changes lane i only if `where` is true
* fast part: the part of a quantity that oscillates with the disturbance, like sin ητ. The slow part is all the rest
* literal: an argument whose value is inserted when a function is compiled
* shape: a function of h of the form c0 + c1 h + c2 h² + α sin h + β vers h + fast part (motion.py)
"""
