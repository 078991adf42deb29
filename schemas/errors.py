"""The few errors that attlog raises on purpose. A message says what, where and what to do next."""


class AttlogError(Exception):
    """Base of all: what the command line prints as one line, without a traceback."""


class InputError(AttlogError):
    """An input cannot be read: missing, empty, of another type, or damaged beyond use."""


class UsageError(AttlogError):
    """Options that do not fit together, or a name that does not exist."""


class StorageError(AttlogError):
    """An output cannot be written: it exists already, or the disk refused."""


class MissingSensorError(AttlogError):
    """An estimator was asked for whose sensor the recording lacks."""
