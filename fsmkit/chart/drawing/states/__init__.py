"""Charts as drawings: what all notations show, and a folder for each."""
