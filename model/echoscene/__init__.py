"""The published EchoScene networks, parameter for parameter, and what the published code computes with them."""
