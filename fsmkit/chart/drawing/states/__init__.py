"""Charts as drawings: the parts common to all notations, and a folder for each."""
