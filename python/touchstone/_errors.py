"""What goes wrong."""

from typing import Optional


class Error(ValueError):
    """A mistake in what was given: the message names file, line, field, value and what is allowed.

    `file`, `line` and `field` are those of the input file, None where the mistake isn't in one (or where its place
    isn't known).
    """

    def __init__(self, message: str, file: Optional[str] = None, line: Optional[int] = None,
                 field: Optional[str] = None):
        super().__init__(message)
        self.file = file
        self.line = line
        self.field = field

    def __reduce__(self):
        return (type(self), (self.args[0], self.file, self.line, self.field))


Error.__module__ = "touchstone"
