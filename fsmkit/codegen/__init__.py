"""What writes machines: a Plan in, files out; a folder for each target."""
