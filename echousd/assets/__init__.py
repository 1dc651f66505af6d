"""Libraries of other people's furniture: what is in them, how each model stands in our frame, which one fits a box."""

STRETCH = 1.15  # largest factor by which a model may be made longer or shorter along an axis
