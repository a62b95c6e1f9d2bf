"""Motion on the canonical body, and what it shows: contacts, rests, interactions, times."""
