"""The subcommands of `idem`: options in, a line and an exit code out."""
