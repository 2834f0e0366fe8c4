"""Views to begin with. Each has a name, an explanation of two or three sentences, and an address."""

from __future__ import annotations

from typing import NamedTuple

ABOUT = {
    "diagram": "A mass slides and sticks on a shaken incline, and hits an obstacle. Each column is one motion, each "
    "dot its velocity at the same moment of a shake: one dot, and the motion repeats with each shake; two, with every "
    "second one. Where dots fill a band, it never repeats.",
    "map": "A mass slides and sticks on a shaken incline, and hits an obstacle. Each point of the map is one motion, "
    "and its colour a number of this motion. Click a point to see the motion move below.",
}
"""Text beside a picture, for each mode."""


class Start(NamedTuple):
    """A view with the text that the page shows beside it."""

    name: str
    text: str
    address: str


STARTS = (
    Start("All of it: period doublings, again and again",
          "Shaken harder, the mass needs two shakes for a beat, then four, then it never repeats, until three shakes "
          "are a beat, and all begins anew. Drag the blue knob along the axis and watch the mass.",
          ""),
    Start("A ripple destroys the structure",
          "A fast ripple, ε, is added to the shaking. Press ▶ at ε: the lines fray, and in the sentence below the "
          "structure of the motion turns from kept to lost.",
          "low=3.0&high=3.25&at=3.04"),
    Start("A time step invents a diagram",
          "No ripple here: the switches are found with fixed steps of Δτ = 0.05. What the steps invent is orange, what "
          "they miss is blue. Move Δτ down until little colour is left.",
          "low=3.0&high=3.25&method=fixed&dtau=0.05&compare=difference&at=3.04"),
    Start("Two points that grow into clouds",
          "One motion, shaken at A = 3.04, with more and more ripple to the right. Its two points become clouds. "
          "Drag the knob across the limit of its structure, which the paper gives as 1.7e-4.",
          "x=eps&low=0&high=3e-4&scale=linear&A=3.04&at=1e-4&periods=300"),
    Start("A window of period 5",
          "Inside the irregular band lie windows in which the motion repeats again, here with every fifth shake. "
          "Turn the wheel at an end of the window: further windows appear.",
          "low=3.155&high=3.178&at=3.165&transient=2000&periods=500"),
    Start("The last band before period 3",
          "Below A = 3.1893 the motion is irregular, above it has period 3. Drag the knob across the border, and "
          "compare the beats of the mass.",
          "low=3.186&high=3.192&at=3.191&transient=2000&periods=500"),
    Start("Map: the period, over shaking and slope",
          "Each colour is a period of the motion, and black has none. Click a point to see it move, and open the "
          "diagram through it.",
          "mode=map&x=A&y=B&low=1.0&high=4.0&y_low=0.0&y_high=0.5&at=3.04&at_y=0.1&periods=66"),
    Start("Map: the power of a pile driver",
          "A machine in SI units: the power of its impacts in W over frequency and amplitude. It has a ridge "
          "just below the values at which the mass begins to skip a shake. Change the friction μ: the ridge moves.",
          "mode=map&x=omega0&y=a0&low=80&high=200&y_low=3e-4&y_high=1.2e-3&at=150&at_y=8e-4&periods=64"
          "&shade=impact_power&bottom=0&top=25"),
)  # fmt: skip
"""Eight views, from the whole to details."""
