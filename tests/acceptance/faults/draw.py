"""Random draws that are the same on every machine and in every Python.

Of Python's generator only what its documentation fixes is used: the Mersenne
Twister's random() of an integer seed. A draw is named by what it is for, so
that one more fault or case changes no other.
"""

import hashlib
import math
import random


class Draw:
    """A stream of draws that is named by its words."""

    def __init__(self, *words):
        text = "/".join(str(word) for word in words)
        digest = hashlib.sha256(text.encode()).digest()
        self._random = random.Random(int.from_bytes(digest[:8], "big")).random

    def uniform(self, lower, upper):
        return lower + (upper - lower) * self._random()

    def log_uniform(self, lower, upper):
        """Each factor of two between the ends is as likely as any other."""
        return lower * math.exp(math.log(upper / lower) * self._random())

    def index(self, count):
        """One of 0 ... count - 1."""
        return min(int(self._random() * count), count - 1)

    def one_of(self, items):
        return items[self.index(len(items))]

    def coin(self):
        return self._random() < 0.5

    def sign(self):
        return -1.0 if self.coin() else 1.0

    def normal(self):
        """Box and Muller."""
        radius = math.sqrt(-2.0 * math.log(1.0 - self._random()))
        return radius * math.cos(2.0 * math.pi * self._random())

    def shuffled(self, items):
        """Fisher and Yates."""
        items = list(items)
        for last in range(len(items) - 1, 0, -1):
            other = self.index(last + 1)
            items[last], items[other] = items[other], items[last]
        return items
