"""An error that whoever runs the program can repair."""


class UserError(ValueError):
    """Input of a person or a file is wrong, or the world lacks something.

    The text is one sentence that names the value and the remedy. Commands print it
    alone; any other UserError, numpy's own included, is a defect and keeps its
    traceback.
    """
