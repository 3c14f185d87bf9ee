"""CSPm, the notation of FDR: a process for each machine and each queue, joined by their events."""
