"""Random numbers for the cases: splitmix64 from a fixed seed. They do not depend on machine and libraries.

Each case has a separate generator, so that one case can be made without the others.
"""

from collections.abc import Sequence
from typing import TypeVar

SEED = 19990609
MASK = 2**64 - 1

Item = TypeVar("Item")


class Draw:
    """Random number generator splitmix64 (Steele, Lea and Flood, 2014). Its start depends on the seed, the level, the
    family and the number of the case."""

    def __init__(self, level: int, family: int, case: int) -> None:
        self.state = SEED
        for part in (level, family, case):
            self.state = (self.bits() + part) & MASK

    def bits(self) -> int:
        """Return the next 64 random bits, as an integer."""
        self.state = (self.state + 0x9E3779B97F4A7C15) & MASK
        z = self.state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & MASK
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & MASK
        return z ^ (z >> 31)

    def uniform(self, low: float, high: float, places: int = 4) -> float:
        """Return a number of [low, high) as a double, rounded to `places` decimals so that its text is short."""
        return round(low + (high - low) * ((self.bits() >> 11) * 2.0**-53), places)

    def choice(self, items: Sequence[Item]) -> Item:
        """Return one of the items, chosen at random."""
        return items[self.bits() % len(items)]
