"""The errors that a caller of physid_drake may catch: one per package, each also the builtin it resembles."""


class PhysidError(Exception):
    """Base of every error that physid_drake raises on purpose; its message is one line for a person."""


class RecordingError(PhysidError, ValueError):
    """A recording breaks a rule of ``physid-recording/1``; the message names file, row and column."""


class ParameterError(PhysidError, ValueError):
    """A parameter or a point ``theta`` is outside its bounds, unknown, or of the wrong shape."""


class TippedError(ParameterError):
    """An object with such a centre of mass does not stand on its base."""


class ConfigError(PhysidError, ValueError):
    """What was asked for cannot be done: the message names the key of a file, the flag, the model or the goal."""


class CellError(PhysidError, ValueError):
    """A cell cannot be built as asked: a mesh that does not load, a shape Drake cannot represent."""


class RobotError(PhysidError, RuntimeError):
    """A robot cannot push: the object is lost, or its world broke down."""


class WorkerError(PhysidError, RuntimeError):
    """A process that was to work on a part was ended from outside."""


class OutputError(PhysidError, OSError):
    """A folder or file of results cannot be written."""


class ProofError(PhysidError, RuntimeError):
    """The proof cannot run: something it needs is missing, or a folder is not as it left it."""
