"""`python -m ocjax` is the `ocjax` command."""

from ocjax.cli import app

if __name__ == "__main__":
    app()
