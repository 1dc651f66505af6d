"""One protocol for whoever lays out rooms: systems, figures, reports, and studies with people."""
