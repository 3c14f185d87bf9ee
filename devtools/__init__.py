"""What develops fsmkit and is not shipped: random charts, the differential test, endurance runs."""
