"""The command line: ``go1-mtl-gym COMMAND``, one file a command; nothing heavy is imported before it is needed."""
