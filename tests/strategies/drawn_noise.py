"""Noise that is known beforehand."""

from echomodel.randomness import Noise


class Drawn(Noise):
    """A source that gives the numbers of a tensor, in their order."""

    def __init__(self, numbers):
        self.numbers = numbers.detach().numpy().ravel()

    def draw(self, count):
        assert count == self.numbers.size
        return self.numbers
