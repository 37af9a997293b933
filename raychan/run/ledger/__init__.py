"""What a run leaves out, entry by entry, with an estimate or a bound of each."""
