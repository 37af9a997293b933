"""Files and folders that a command writes: all of before or all new."""
