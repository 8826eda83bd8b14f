"""The command `ocjax`, run in this process."""

from typer.testing import CliRunner

from ocjax.cli.app import app

runner = CliRunner()


def run(*args):
    return run_app(app, *args)


def run_app(app, *args):
    """Run a command of typer in this process."""
    return runner.invoke(app, [str(a) for a in args], terminal_width=200)
