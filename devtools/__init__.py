"""Development tools that are not shipped: random charts, differential test, endurance runs."""
