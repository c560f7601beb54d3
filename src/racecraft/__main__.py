"""`python -m racecraft`, the same as the command ``racecraft``."""

from racecraft.cli import main

if __name__ == "__main__":
    main()
