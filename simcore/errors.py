"""The errors a user can meet; everything else is a bug and keeps its traceback."""


class SimcoreError(Exception):
    """Base of all errors that carry a message for the user."""


class DesignError(SimcoreError):
    """A study, design or mesh that cannot be simulated as written.

    The message is one line that names the file, the key and the accepted values.
    The command line prints it and exits with code 2.
    """


class SimulationError(SimcoreError):
    """A candidate that failed while it was simulated.

    A sweep records it as a row with `status` and the message as its reason.

    Parameters
    ----------
    status : str
        One of the failure statuses of `simcore.metrics.STATUS`.
    reason : str
        One line for the user.
    """

    def __init__(self, status: str, reason: str):
        super().__init__(reason)
        self.status = status
        self.reason = reason
