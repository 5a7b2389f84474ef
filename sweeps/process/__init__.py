"""Process and machine: output files, progress, memory, processors, interrupts, liveness."""
