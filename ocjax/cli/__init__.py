"""The command `ocjax`: one file per subcommand."""
