"""Floor plans of others: each format's reader says what a file holds in one common form, which becomes a home."""
