"""``python -m trainers``: the command line, where ``go1-mtl-gym`` is not on the path."""

from trainers.cli.program import run

if __name__ == "__main__":
    raise SystemExit(run())
