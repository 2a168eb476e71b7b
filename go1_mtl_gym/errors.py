"""The exceptions of the package: one base class, messages that say what came and what was expected."""


class Go1Error(Exception):
    """Base class of every error that this project raises on purpose."""


class InvalidInputError(Go1Error, ValueError):
    """An argument is outside what the documentation allows; nothing was changed by the call."""
