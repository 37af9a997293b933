"""Lines that a run prints and stores."""
