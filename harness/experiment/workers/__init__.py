"""Workers that evaluate cells: executors, the loop over tasks, progress and interrupts."""
