"""A ship with a laser scanner: its scene, its bridge, the closed loop and what a voyage leaves."""
