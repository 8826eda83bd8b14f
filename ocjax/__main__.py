"""`python -m ocjax` is the `ocjax` command."""

from ocjax.cli.app import app

if __name__ == "__main__":
    app()
