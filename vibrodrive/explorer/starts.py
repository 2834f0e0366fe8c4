"""Views to begin with. Each has a name, an explanation of two or three sentences, and an address."""

from __future__ import annotations

from typing import NamedTuple

ABOUT = {
    "diagram": "A mass on a shaken incline slides, sticks, and hits an obstacle without rebound. Each column of the "
    "picture is one motion: a black dot is its value at one phase of the shaking, in each period. With one dot the "
    "motion repeats in each period, with two dots in every second period. In a grey band the motion does not repeat. "
    "Click a column to see its motion and the limit k₂. A disturbance of relative amplitude ε = k₂ destroys the "
    "pattern of impacts of this motion, its structure. ▶ beside ε shows this. Drag, or turn the wheel, to see details.",
    "map": "A mass on a shaken incline slides, sticks, and hits an obstacle without rebound. Each point of the map is "
    "one motion. The colour shows one number of this motion, with a key below the map. Period 1 means that the motion "
    "repeats in each period of the shaking. Click a point to see the diagram through this point.",
}
"""Text beside a picture, for each mode."""


class Start(NamedTuple):
    """A view with the text that the page shows beside it."""

    name: str
    text: str
    address: str


STARTS = (
    Start("Fig. 3: all amplitudes",
          "Without disturbance the velocity has one value at small A. For larger A its values double repeatedly, and "
          "finally fill bands. Zoom into a band to see windows with few values.",
          "low=0.0025&high=3.25&transient=1000&periods=300"),
    Start("Fig. 5: a small ripple, no impact lost",
          "At A = 1.5 a disturbance ε = 5e-4 keeps the order of impacts. Its force is five times the excitation. "
          "Set ε to 0 and compare the curves.",
          "low=1.2&high=1.8&eps=5e-4&at=1.5&transient=500&periods=100"),
    Start("Fig. 6: two points that grow into clouds",
          "At A = 3.04 and ε = 0 the motion has two points (period 2). With larger ε they become clouds. The paper "
          "gives the limit 1.7e-4: click a column to compare it with k₂.",
          "x=eps&low=0&high=3e-4&scale=linear&A=3.04&transient=500&periods=300"),
    Start("Fig. 7: a ripple that destroys the structure",
          "Between A = 3 and 3.25 the disturbance ε = 2e-4 turns branches into bands. "
          "Move ε to 0 slowly to see where the windows appear again.",
          "low=3.0&high=3.25&eps=2e-4&transient=500&periods=500"),
    Start("Fig. 8: steps too large for the structure",
          "At A = 1.5 fixed steps above Δτ = 0.69 omit the state stick in some periods. The paper calls this a lost "
          "structure; the k₂ of this page counts impacts, which are kept up to 1.16. Click 0.5 and 0.7 and compare.",
          "x=dtau&low=0.05&high=0.8&scale=linear&method=fixed&A=1.5&at=0.5&transient=500&periods=100"),
    Start("Fig. 10: a coarse time step instead of a ripple",
          "Without a disturbance, fixed steps of Δτ = 0.1 change the picture. "
          "Select \"as a difference\" at Certified motions, then reduce Δτ until little colour remains.",
          "low=3.0&high=3.25&method=fixed&dtau=0.1&transient=500&periods=500"),
    Start("Fig. 12: one motion with steps of 0.1",
          "At A = 3.04 the certified motion has two points (period 2), and fixed steps of Δτ = 0.1 scatter these "
          "points. The text below describes the motion and its limit k₂. Reduce Δτ until the points come together.",
          "low=2.95&high=3.1&method=fixed&dtau=0.1&compare=beside&at=3.04&transient=500&periods=300"),
    Start("First doubling, with the exact orbits",
          "Blue lines are stable periodic orbits, dashed lines are unstable orbits, and circles are bifurcations. "
          "Move the mouse over a circle to see the kind and the A of its bifurcation.",
          "low=2.4&high=3.25&orbits=4"),
    Start("A window of period 5",
          "Between A = 3.161 and 3.169 the motion has period 5. At larger A the period doubles to 10. "
          "Zoom into an end of the window to see further windows, and numbers with all digits.",
          "low=3.155&high=3.178&transient=2000&periods=500"),
    Start("Windows of periods 7 and 8",
          "The period is 7 from A = 3.1786 to 3.1831, and 8 from 3.1837 to 3.1847; between them are narrower windows. "
          "Press Mark and click both ends of a window to read its width.",
          "low=3.176&high=3.187&transient=2000&periods=500"),
    Start("The last band before period 3",
          "The motion is irregular below A = 3.1893, and has period 3 from 3.1893 to 3.25. "
          "Click a column on either side and compare the cycles of states.",
          "low=3.186&high=3.192&transient=2000&periods=500"),
    Start("Map: the period over A and B, with exact curves",
          "Each colour is a period of the motion. The lines are exact bifurcations; they appear within about a minute. "
          "A click on a point shows the diagram through this point.",
          "mode=map&x=A&y=B&low=1.0&high=4.0&y_low=0.0&y_high=0.5&periods=66&shade=period&orbits=1"),
    Start("A machine in SI units: the power of its impacts",
          "The map shows the power in W over frequency and amplitude, for μ = 0.6 and an incline of 3.4°. "
          "The power has a ridge just below the values at which the mass begins to skip a period. "
          "Click the ridge to see the diagram through it, or change μ.",
          "mode=map&x=omega0&y=a0&low=80&high=200&y_low=3e-4&y_high=1.2e-3&periods=64"
          "&shade=impact_power&bottom=0&top=25"),
)  # fmt: skip
"""The paper's figures that a diagram or map can show, and other interesting views."""
