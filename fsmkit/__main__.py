"""``python -m fsmkit``: the command line, where its script is not on the path."""

from fsmkit.cli import main

if __name__ == "__main__":
    main()
