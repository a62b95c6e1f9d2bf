"""Motion on the canonical body, and what is read off it: contacts, rests, uses of furniture."""
