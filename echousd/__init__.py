"""EchoUSD: author indoor scenes in USD from semantic scene graphs."""

__version__ = "0.1.0"
