"""Views to begin with: a name, two sentences, and the address of each."""

from __future__ import annotations

from typing import NamedTuple


class Start(NamedTuple):
    """A view with the text that the page shows beside it."""

    name: str
    text: str
    address: str


_HALF_PI = "section_phase=1.5707963267948966"

STARTS = (
    Start("Fig. 3: all amplitudes",
          "The section velocity over A, without disturbance: one value, then doublings, then bands. "
          "Zoom into a band, and windows with few values appear.",
          f"low=0.0025&high=3.25&transient=1000&periods=300&{_HALF_PI}"),
    Start("Fig. 5: a small ripple, no period lost",
          "At A = 1.5 a disturbance ε = 5e-4 keeps the impacts, although its force is five times the excitation. "
          "Set ε to 0 and compare the curves.",
          "low=1.2&high=1.8&eps=5e-4&at=1.5&transient=500&periods=100"),
    Start("Fig. 7: a ripple that destroys the structure",
          "The diagram between A = 3 and 3.25 with ε = 2e-4: branches become bands. "
          "Move ε to 0 slowly, and look where the windows return.",
          f"low=3.0&high=3.25&eps=2e-4&transient=500&periods=500&{_HALF_PI}"),
    Start("Fig. 10: a coarse time step does the same",
          "Fixed steps of Δτ = 0.1 without any disturbance: the step alone changes the picture. "
          "Choose Certified motions: as a difference, then reduce Δτ until little colour remains.",
          f"low=3.0&high=3.25&method=fixed&dtau=0.1&transient=500&periods=500&{_HALF_PI}"),
    Start("Fig. 12: one motion with steps of 0.1",
          "At A = 3.04 the certified motion has period 2; fixed steps of Δτ = 0.1 scatter it. "
          "The text below the diagram gives both, and the limit k₂.",
          "low=2.95&high=3.1&method=fixed&dtau=0.1&compare=beside&at=3.04&transient=500&periods=300"),
    Start("First doubling, with the exact orbits",
          "Blue lines are stable periodic orbits, dashed ones unstable; a circle marks each bifurcation. "
          "Point at a circle to see its kind and its A.",
          f"low=2.4&high=3.25&orbits=4&{_HALF_PI}"),
    Start("A window in the chaotic band",
          "Between A = 3.1531 and 3.1536 the motion is periodic amid bands. "
          "Zoom further: the picture is computed again at each scale, and numbers keep all digits.",
          f"low=3.15&high=3.165&transient=2000&periods=500&{_HALF_PI}"),
    Start("Map: the period over A and B",
          "Each colour is a period of the motion. A click shows the diagram through that point; "
          "exact orbits up to period 2 add the curves of the bifurcations.",
          "mode=map&x=A&y=B&low=1.0&high=4.0&y_low=0.0&y_high=0.5&periods=64&shade=period"),
    Start("A machine in SI units: the power of its impacts",
          "A driver with μ = 0.6 on an incline of 3.4° over frequency and amplitude; the colour is the power in W. "
          "Look for the ridges just before a period is lost.",
          "mode=map&x=omega0&y=a0&low=80&high=200&y_low=3e-4&y_high=1.2e-3&periods=64"
          "&shade=impact_power&bottom=0&top=25"),
)  # fmt: skip
"""The paper's figures that a diagram or map can show, and views worth a visit."""
