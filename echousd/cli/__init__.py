"""The command line: one module per topic, each importing what it needs inside its commands."""
