"""Training sets: windows of furnished motion, how they are stored, carried and looked at."""
