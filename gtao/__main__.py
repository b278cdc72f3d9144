"""``python -m gtao`` is the ``gtao`` command."""

from .cli import main

if __name__ == "__main__":
    main()
