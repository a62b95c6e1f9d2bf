"""Frozen clips of bodies, and pieces of makers, that training never sees: what measures weights."""
