"""Libraries of other people's furniture: what is in them, how each model stands in our frame, which one fits a box."""
